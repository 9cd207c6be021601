//! What keys do: one table, from which also the help on the screen and in the terminal are made.
//!
//! In:    a key by its place on a US keyboard, and whether Shift is held.
//! Out:   an [`Action`]; lines of help.
//! Keeps: nothing.
//! Not here: what actions do (`session`), windows (`window`).

use super::play::Seek;
use winit::keyboard::KeyCode;

/// A way to fly while a key is held.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Way {
    /// Where the eye looks.
    Ahead,
    /// Away from there.
    Back,
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Towards the ground.
    Down,
    /// Away from the ground.
    Up,
}

/// What somebody wants.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Action {
    /// To fly, as long as the key is held.
    Fly(Way),
    /// To look elsewhere: right and up, in pixels of the window.
    Look([f64; 2]),
    /// To fly faster, or slower: notches of the wheel.
    Speed(f64),
    /// To play or pause the flight.
    PlayPause,
    /// To see the next frame of the flight, or the one before.
    Step(isize),
    /// To see another part of the flight.
    Seek(Seek),
    /// Back to the flight.
    Follow,
    /// A later time of day, in hours.
    Later(f64),
    /// The mesh shall stay as it is, or move again.
    Freeze,
    /// Another debug view, counted from 0.
    Show(usize),
    /// Bounds of the patches.
    Boxes,
    /// Diamonds and their children.
    Links,
    /// Times of the last frames.
    Graph,
    /// Numbers.
    Hud,
    /// A finer tolerance (−1) or a coarser one (1).
    Tolerance(i8),
    /// A picture, and what reproduces it.
    Screenshot,
    /// The list of keys.
    Help,
    /// The end.
    Quit,
}

/// One key of a row.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Key {
    code: KeyCode,
    /// `None`: with Shift or without.
    shift: Option<bool>,
    /// As people and scripts call it.
    pub name: &'static str,
    /// What it does.
    pub action: Action,
}

/// Keys that belong together, and what they do.
pub struct Row {
    /// The keys.
    pub keys: &'static [Key],
    /// In a few words.
    pub help: &'static str,
}

const fn key(name: &'static str, code: KeyCode, action: Action) -> Key {
    Key { code, shift: None, name, action }
}

const fn show(name: &'static str, code: KeyCode, index: usize) -> Key {
    key(name, code, Action::Show(index))
}

const fn shifted(name: &'static str, code: KeyCode, shift: bool, action: Action) -> Key {
    Key { code, shift: Some(shift), name, action }
}

/// All keys.
pub const ROWS: [Row; 17] = [
    Row {
        keys: &[
            key("W", KeyCode::KeyW, Action::Fly(Way::Ahead)),
            key("A", KeyCode::KeyA, Action::Fly(Way::Left)),
            key("S", KeyCode::KeyS, Action::Fly(Way::Back)),
            key("D", KeyCode::KeyD, Action::Fly(Way::Right)),
        ],
        help: "fly; the higher, the faster (drag: look, wheel: speed)",
    },
    Row {
        keys: &[
            key("Q", KeyCode::KeyQ, Action::Fly(Way::Down)),
            key("E", KeyCode::KeyE, Action::Fly(Way::Up)),
        ],
        help: "down, up",
    },
    Row {
        keys: &[key("Space", KeyCode::Space, Action::PlayPause)],
        help: "play or pause the flight",
    },
    Row {
        keys: &[
            key(",", KeyCode::Comma, Action::Step(-1)),
            key(".", KeyCode::Period, Action::Step(1)),
        ],
        help: "one frame of the flight back, on",
    },
    Row {
        keys: &[
            key("Left", KeyCode::ArrowLeft, Action::Seek(Seek::Back)),
            key("Right", KeyCode::ArrowRight, Action::Seek(Seek::On)),
        ],
        help: "five seconds of the flight back, on",
    },
    Row {
        keys: &[
            key("Home", KeyCode::Home, Action::Seek(Seek::Start)),
            key("End", KeyCode::End, Action::Seek(Seek::End)),
        ],
        help: "first, last frame of the flight",
    },
    Row { keys: &[key("R", KeyCode::KeyR, Action::Follow)], help: "back to the flight" },
    Row {
        keys: &[
            shifted("T", KeyCode::KeyT, false, Action::Later(0.25)),
            shifted("Shift+T", KeyCode::KeyT, true, Action::Later(-0.25)),
        ],
        help: "a quarter of an hour later, earlier",
    },
    Row { keys: &[key("F", KeyCode::KeyF, Action::Freeze)], help: "freeze the level of detail" },
    Row {
        keys: &[
            show("1", KeyCode::Digit1, 0),
            show("2", KeyCode::Digit2, 1),
            show("3", KeyCode::Digit3, 2),
            show("4", KeyCode::Digit4, 3),
            show("5", KeyCode::Digit5, 4),
            show("6", KeyCode::Digit6, 5),
            show("7", KeyCode::Digit7, 6),
            show("8", KeyCode::Digit8, 7),
        ],
        help: "shaded, wires, level, error, pages, normals, range, culled",
    },
    Row {
        keys: &[key("B", KeyCode::KeyB, Action::Boxes), key("N", KeyCode::KeyN, Action::Links)],
        help: "bounds of patches, links of diamonds",
    },
    Row { keys: &[key("G", KeyCode::KeyG, Action::Graph)], help: "times of the last frames" },
    Row { keys: &[key("H", KeyCode::KeyH, Action::Hud)], help: "numbers" },
    Row {
        keys: &[
            key("[", KeyCode::BracketLeft, Action::Tolerance(-1)),
            key("]", KeyCode::BracketRight, Action::Tolerance(1)),
        ],
        help: "finer, coarser tolerance",
    },
    Row {
        keys: &[key("P", KeyCode::KeyP, Action::Screenshot)],
        help: "picture, and a file that reproduces it",
    },
    Row { keys: &[key("F1", KeyCode::F1, Action::Help)], help: "these keys" },
    Row { keys: &[key("Esc", KeyCode::Escape, Action::Quit)], help: "quit" },
];

fn keys() -> impl Iterator<Item = &'static Key> {
    ROWS.iter().flat_map(|row| row.keys)
}

/// What a key does.
pub fn action(code: KeyCode, shift: bool) -> Option<Action> {
    let fits = |key: &&Key| key.code == code && key.shift.is_none_or(|wanted| wanted == shift);
    keys().find(fits).map(|key| key.action)
}

/// Whether a key that is held does this again and again.
pub fn repeats(action: Action) -> bool {
    matches!(action, Action::Step(_) | Action::Seek(_) | Action::Later(_))
}

/// What the key of a name does; upper and lower case are the same.
pub fn named(name: &str) -> Option<Action> {
    keys().find(|key| key.name.eq_ignore_ascii_case(name)).map(|key| key.action)
}

/// The table as lines.
pub fn help() -> Vec<String> {
    let line = |row: &Row| {
        let names: Vec<&str> = row.keys.iter().map(|key| key.name).collect();
        let names = match names[..] {
            [first, .., last] if names.len() > 4 => format!("{first} - {last}"),
            _ => names.join(" "),
        };
        format!("{names:<12}{}", row.help)
    };
    ROWS.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use overfly::render_vk::Show;

    #[test]
    fn no_key_does_two_things() {
        for shift in [false, true] {
            for key in keys().filter(|key| key.shift.is_none_or(|wanted| wanted == shift)) {
                assert_eq!(action(key.code, shift), Some(key.action), "{}", key.name);
            }
        }
        for key in keys() {
            assert_eq!(named(&key.name.to_lowercase()), Some(key.action));
        }
        assert_eq!((action(KeyCode::F12, false), named("F12")), (None, None));
    }

    #[test]
    fn there_is_a_key_for_every_debug_view_and_no_more() {
        let shows = keys().filter_map(|key| match key.action {
            Action::Show(index) => Some(index),
            _ => None,
        });
        assert_eq!(shows.collect::<Vec<_>>(), (0..Show::ALL.len()).collect::<Vec<_>>());
    }

    #[test]
    fn help_has_a_line_for_each_row_that_fits_a_small_window() {
        let help = help();
        assert_eq!(help.len(), ROWS.len());
        for (line, row) in help.iter().zip(&ROWS) {
            assert!(line.starts_with(row.keys[0].name) && line.ends_with(row.help), "{line}");
            assert!(line.len() <= 72, "{line}");
        }
        assert_eq!(help[7], "T Shift+T   a quarter of an hour later, earlier");
        assert!(help[9].starts_with("1 - 8 "), "{}", help[9]);
    }
}
