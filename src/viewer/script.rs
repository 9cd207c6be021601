//! Scripts that stand in for hands: for tests and demonstrations.
//!
//! In:    text such as `frames 20; key W 10; resize 640x480; quit`.
//! Out:   what to do before each frame.
//! Keeps: [`Script`]: the steps that are left.
//! Not here: doing it (`window`).

use super::keys::{self, Action};
use crate::cli::replay::parse_size;
use std::collections::VecDeque;
use std::fmt;

/// A window that has not taken a size after so many frames never will.
const RESIZE_FRAMES_MAX: u32 = 600;

/// Shown where a script is explained.
pub const STEPS: &str = "frames N, key NAME [FRAMES], drag RIGHT UP, wheel NOTCHES, \
                         resize WxH, quit";

/// One step of a script.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Step {
    Frames(u32),
    Key(Action, u32),
    Do(Action),
    Resize([u32; 2]),
}

/// What a script wants before a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Command {
    /// A key goes down.
    Press(Action),
    /// A key goes up.
    Release(Action),
    /// The window shall have this size.
    Resize([u32; 2]),
    /// The window has not taken the size that was asked for.
    Stuck([u32; 2]),
}

/// The steps that are left.
#[derive(Clone, PartialEq, Debug)]
pub struct Script {
    steps: VecDeque<Step>,
    /// Frames since the first step began.
    frames: u32,
}

/// Why a script cannot be followed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ScriptFault {
    step: String,
}

impl fmt::Display for ScriptFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is none of: {STEPS}; NAME is a key of --help", self.step)
    }
}

impl std::error::Error for ScriptFault {}

impl std::str::FromStr for Script {
    type Err = ScriptFault;

    fn from_str(text: &str) -> Result<Self, ScriptFault> {
        let steps = text.split(';').map(str::trim).filter(|step| !step.is_empty());
        let parse = |text: &str| step(text).ok_or_else(|| ScriptFault { step: text.into() });
        Ok(Self { steps: steps.map(parse).collect::<Result<_, _>>()?, frames: 0 })
    }
}

fn step(text: &str) -> Option<Step> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let number = |word: &str| word.parse::<f64>().ok().filter(|number| number.is_finite());
    Some(match words[..] {
        ["frames", frames] => Step::Frames(frames.parse().ok()?),
        ["key", name] => Step::Key(keys::named(name)?, 0),
        ["key", name, frames] => Step::Key(keys::named(name)?, frames.parse().ok()?),
        ["drag", right, up] => Step::Do(Action::Look([number(right)?, number(up)?])),
        ["wheel", notches] => Step::Do(Action::Speed(number(notches)?)),
        ["resize", size] => Step::Resize(parse_size(size).ok()?),
        ["quit"] => Step::Do(Action::Quit),
        _ => return None,
    })
}

impl Script {
    /// What to do before the next frame of a window of this size: steps take a frame each, and more
    /// where they say so; a resize waits until the window has the size.
    pub fn before_frame(&mut self, size_px: [u32; 2], todo: &mut Vec<Command>) {
        let Some(&step) = self.steps.front() else { return };
        let begins = self.frames == 0;
        self.frames += 1;
        let ends = match step {
            Step::Frames(frames) => self.frames >= frames,
            Step::Do(action) => {
                todo.extend([Command::Press(action), Command::Release(action)]);
                true
            }
            Step::Key(action, frames) => {
                if begins {
                    todo.push(Command::Press(action));
                }
                let ends = self.frames > frames;
                if ends {
                    todo.push(Command::Release(action));
                }
                ends
            }
            Step::Resize(wanted) => {
                if begins {
                    todo.push(Command::Resize(wanted));
                }
                let stuck = self.frames > RESIZE_FRAMES_MAX;
                if stuck {
                    todo.push(Command::Stuck(wanted));
                }
                stuck || size_px == wanted
            }
        };
        if ends {
            self.steps.pop_front();
            self.frames = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::keys::Way;

    /// What a script does before each of so many frames.
    fn played(text: &str, frames: usize, size_px: [u32; 2]) -> Vec<Vec<Command>> {
        let mut script: Script = text.parse().unwrap();
        let frame = |_| {
            let mut todo = Vec::new();
            script.before_frame(size_px, &mut todo);
            todo
        };
        (0..frames).map(frame).collect()
    }

    #[test]
    fn a_key_is_held_for_as_many_frames_as_it_says() {
        let ahead = Action::Fly(Way::Ahead);
        let (press, release) = (Command::Press(ahead), Command::Release(ahead));
        let expected = [vec![], vec![], vec![press], vec![], vec![], vec![release], vec![], vec![]];
        assert_eq!(played("frames 2; key W 3; frames 1;", 8, [9, 9]), expected);
        let tapped = played("key f1", 2, [9, 9]);
        let help = [Command::Press(Action::Help), Command::Release(Action::Help)];
        assert_eq!(tapped, [help.to_vec(), vec![]]);
    }

    #[test]
    fn a_resize_waits_for_its_size_and_not_for_ever() {
        let resize = Command::Resize([640, 480]);
        let quit = [Command::Press(Action::Quit), Command::Release(Action::Quit)].to_vec();
        let text = "resize 640x480; quit";
        assert_eq!(played(text, 2, [640, 480]), [vec![resize], quit.clone()]);
        let waiting = played(text, 700, [1, 1]);
        let busy: Vec<_> = waiting.into_iter().filter(|todo| !todo.is_empty()).collect();
        assert_eq!(busy, [vec![resize], vec![Command::Stuck([640, 480])], quit]);
    }

    #[test]
    fn what_is_no_step_is_named() {
        for text in ["key Windows", "frames -1", "fly away", "drag 1", "resize 0x4", "wheel inf"] {
            let fault = format!("frames 1; {text}").parse::<Script>().unwrap_err();
            assert!(fault.to_string().starts_with(&format!("`{text}` is none of")), "{fault}");
        }
    }
}
