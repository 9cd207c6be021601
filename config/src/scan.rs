//! The words of RON: blanks and comments, names, texts, characters, numbers.
//!
//! In:    the text of a file.
//! Out:   one token at a time, or the [`Syntax`] fault where there is none.
//! Keeps: the place in the text.
//! Not here: brackets and what they hold (`tree`).

use crate::node::Kind;

/// Something that is not RON, at byte `at`.
pub(crate) struct Syntax {
    pub at: usize,
    pub what: String,
}

/// A place in the text.
pub(crate) struct Scan<'t> {
    pub text: &'t str,
    pub at: usize,
    /// Brackets open around it.
    pub depth: u32,
    /// Faults that did not hide the structure of the file.
    pub faults: Vec<Syntax>,
}

pub(crate) type Parsed<T> = Result<T, Syntax>;

impl Scan<'_> {
    pub(crate) fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    pub(crate) fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    pub(crate) fn take(&mut self, token: &str) -> bool {
        let found = self.rest().starts_with(token);
        self.at += if found { token.len() } else { 0 };
        found
    }

    pub(crate) fn take_while(&mut self, wanted: impl Fn(char) -> bool) -> String {
        let length = self.rest().find(|c| !wanted(c)).unwrap_or(self.rest().len());
        let taken = self.rest()[..length].to_owned();
        self.at += length;
        taken
    }

    pub(crate) fn fail<T>(&self, expected: &str) -> Parsed<T> {
        let found = match self.peek() {
            Some(c) => format!("`{}`", c.escape_debug()),
            None => "the end of the file".to_owned(),
        };
        Err(Syntax { at: self.at, what: format!("found {found}, expected {expected}") })
    }

    /// Skips white space and comments; block comments nest.
    pub(crate) fn skip_blank(&mut self) -> Parsed<()> {
        loop {
            self.take_while(is_blank);
            if self.take("//") {
                self.take_while(|c| c != '\n');
            } else if self.rest().starts_with("/*") {
                self.block_comment()?;
            } else {
                return Ok(());
            }
        }
    }

    fn block_comment(&mut self) -> Parsed<()> {
        let (start, mut level) = (self.at, 0_u32);
        loop {
            if self.take("/*") {
                level += 1;
            } else if self.take("*/") {
                level -= 1;
            } else if let Some(c) = self.peek() {
                self.at += c.len_utf8();
            } else {
                return Err(Syntax { at: start, what: "comment without end".into() });
            }
            if level == 0 {
                return Ok(());
            }
        }
    }

    pub(crate) fn word(&mut self) -> Parsed<String> {
        if !self.peek().is_some_and(is_word_start) {
            return self.fail("a name");
        }
        Ok(self.take_while(is_word))
    }

    pub(crate) fn text(&mut self) -> Parsed<Kind> {
        let start = self.at;
        self.at += 1;
        let mut text = String::new();
        while let Some(c) = self.peek() {
            self.at += c.len_utf8();
            match c {
                '"' => return Ok(Kind::Text(text)),
                '\\' if self.take("\n") || self.take("\r\n") => {
                    self.take_while(|c| " \t\r\n".contains(c));
                }
                '\\' => text.push(self.escape()?),
                _ => text.push(c),
            }
        }
        Err(Syntax { at: start, what: "text without closing `\"`".into() })
    }

    pub(crate) fn raw_text(&mut self) -> Parsed<Kind> {
        let start = self.at;
        self.at += 1;
        let close = format!("\"{}", self.take_while(|c| c == '#'));
        if !self.take("\"") {
            return self.fail("`\"` of a raw text");
        }
        let Some(length) = self.rest().find(&close) else {
            return Err(Syntax { at: start, what: format!("raw text without closing `{close}`") });
        };
        let text = self.rest()[..length].to_owned();
        self.at += length + close.len();
        Ok(Kind::Text(text))
    }

    pub(crate) fn character(&mut self) -> Parsed<Kind> {
        self.at += 1;
        let Some(c) = self.peek() else { return self.fail("a character") };
        self.at += c.len_utf8();
        if c == '\\' {
            self.escape()?;
        }
        if self.take("'") { Ok(Kind::Char) } else { self.fail("`'`") }
    }

    /// The character that an escape stands for; its `\` has been taken.
    fn escape(&mut self) -> Parsed<char> {
        let at = self.at - 1;
        let Some(c) = self.peek() else { return self.fail("an escape") };
        self.at += c.len_utf8();
        let escaped = match c {
            '\'' | '"' | '\\' => Some(c),
            'n' => Some('\n'),
            'r' => Some('\r'),
            't' => Some('\t'),
            '0' => Some('\0'),
            'x' => {
                let digits: String = self.rest().chars().take(2).collect();
                self.at += digits.len();
                code_point(&digits, 2..=2).filter(char::is_ascii)
            }
            'u' if self.take("{") => {
                let digits = self.take_while(|c| c.is_ascii_hexdigit());
                if self.take("}") { code_point(&digits, 1..=6) } else { None }
            }
            _ => None,
        };
        escaped.ok_or_else(|| Syntax { at, what: "unknown escape".into() })
    }

    /// A number that cannot be read is reported without losing the rest of the file.
    pub(crate) fn number(&mut self) -> Kind {
        let (at, mut before) = (self.at, 'e');
        while let Some(c) = self.peek() {
            let signed = "+-".contains(c) && "eE".contains(before);
            if !(signed || is_word(c) || c == '.') {
                break;
            }
            self.at += c.len_utf8();
            before = c;
        }
        let token = &self.text[at..self.at];
        number(token).unwrap_or_else(|| {
            let what = format!("`{token}` is not a number");
            self.faults.push(Syntax { at, what });
            Kind::Broken
        })
    }
}

fn code_point(digits: &str, lengths: std::ops::RangeInclusive<usize>) -> Option<char> {
    let hex = lengths.contains(&digits.len()) && digits.chars().all(|c| c.is_ascii_hexdigit());
    char::from_u32(u32::from_str_radix(if hex { digits } else { "" }, 16).ok()?)
}

/// Reads what `ron` reads: signs, `0x`, `0o`, `0b`, underscores after digits, exponents, `inf`.
fn number(token: &str) -> Option<Kind> {
    let (sign, digits) = match token.strip_prefix(['+', '-']) {
        Some(digits) => (if token.starts_with('-') { -1 } else { 1 }, digits),
        None => (1, token),
    };
    match digits {
        "inf" => return Some(Kind::Decimal(f64::INFINITY * f64::from(sign))),
        "NaN" => return Some(Kind::Decimal(f64::NAN)),
        _ => {}
    }
    let (base, body) = match digits.get(..2) {
        Some("0x") => (16, &digits[2..]),
        Some("0o") => (8, &digits[2..]),
        Some("0b") => (2, &digits[2..]),
        _ => (10, digits),
    };
    let plain: String = body.chars().filter(|&c| c != '_').collect();
    let all_digits = !body.starts_with('_') && plain.chars().all(|c| c.is_digit(base));
    if all_digits && let Ok(value) = i128::from_str_radix(&plain, base) {
        return Some(Kind::Whole { value: value * i128::from(sign), decimal: base == 10 });
    }
    let float = body.chars().all(|c| c.is_ascii_digit() || "eE.+-_".contains(c));
    let underscore = body.starts_with('_') || body.contains("._");
    if base != 10 || !float || underscore {
        return None;
    }
    plain.parse().ok().map(|value: f64| Kind::Decimal(value * f64::from(sign)))
}

/// What `ron` takes for white space.
fn is_blank(c: char) -> bool {
    c.is_ascii_whitespace()
        || matches!(c, '\x0B' | '\u{85}' | '\u{200E}' | '\u{200F}' | '\u{2028}' | '\u{2029}')
}

pub(crate) fn is_word_start(c: char) -> bool {
    c == '_' || c.is_alphabetic()
}

fn is_word(c: char) -> bool {
    c == '_' || c.is_alphanumeric()
}
