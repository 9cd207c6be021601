//! RON text to a tree that remembers where each value stood.
//!
//! In:    the text of a file.
//! Out:   a [`Node`] per value with its byte range, and the syntax faults.
//! Keeps: nothing.
//! Not here: names and numbers (`scan`), what a scene may hold (`scene`), byte strings.

use crate::node::{Field, Kind, Node};
use crate::scan::{Parsed, Scan, Syntax, is_word_start};

/// Values nest no deeper than this, so that no file can exhaust the stack.
const DEPTH_MAX: u32 = 32;

/// Reads the whole text. Without a tree there is at least one fault.
pub(crate) fn parse(text: &str) -> (Option<Node>, Vec<Syntax>) {
    let mut scan = Scan { text, at: 0, depth: 0, faults: Vec::new() };
    let root = scan.document();
    let Scan { mut faults, .. } = scan;
    (root.map_err(|fault| faults.push(fault)).ok(), faults)
}

impl Scan<'_> {
    fn document(&mut self) -> Parsed<Node> {
        self.skip_blank()?;
        if self.peek() == Some('#') {
            return self.fail("a value; `#![enable(…)]` has no place in a scene file");
        }
        let root = self.value()?;
        self.skip_blank()?;
        if self.peek().is_some() { self.fail("the end of the file") } else { Ok(root) }
    }

    fn value(&mut self) -> Parsed<Node> {
        let at = self.at;
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            let what = format!("nested deeper than {DEPTH_MAX} values");
            return Err(Syntax { at, what });
        }
        let kind = match self.peek() {
            Some('(') => self.brackets(None)?,
            Some('[') => self.list()?,
            Some('{') => self.map()?,
            Some('"') => self.text()?,
            Some('\'') => self.character()?,
            Some(c) if c.is_ascii_digit() || "+-.".contains(c) => self.number(),
            Some('r') if self.rest().starts_with("r\"") || self.rest().starts_with("r#") => {
                self.raw_text()?
            }
            Some('b') if self.rest().starts_with("b\"") || self.rest().starts_with("b'") => {
                return self.fail("a value; byte strings have no place in a scene file");
            }
            Some(c) if is_word_start(c) => self.named()?,
            _ => return self.fail("a value"),
        };
        self.depth -= 1;
        Ok(Node { at, end: self.at, kind })
    }

    /// A value that starts with a name.
    fn named(&mut self) -> Parsed<Kind> {
        let word = self.word()?;
        match word.as_str() {
            "true" | "false" => return Ok(Kind::Bool(word == "true")),
            "inf" => return Ok(Kind::Decimal(f64::INFINITY)),
            "NaN" => return Ok(Kind::Decimal(f64::NAN)),
            _ => {}
        }
        let end = self.at;
        self.skip_blank()?;
        if self.peek() == Some('(') {
            return self.brackets(Some(word));
        }
        self.at = end;
        Ok(Kind::Word(word))
    }

    /// After the value in brackets: whether another one follows, else `close` has been taken.
    fn more(&mut self, close: char) -> Parsed<bool> {
        self.skip_blank()?;
        let comma = self.take(",");
        self.skip_blank()?;
        if self.peek() == Some(close) {
            self.at += close.len_utf8();
            return Ok(false);
        }
        if comma { Ok(true) } else { self.fail(&format!("`,` or `{close}`")) }
    }

    /// Whether the brackets that were just opened close at once.
    fn empty(&mut self, close: &str) -> Parsed<bool> {
        self.skip_blank()?;
        Ok(self.take(close))
    }

    /// The inside of `(…)`: fields when a name and a colon come first, else a tuple.
    fn brackets(&mut self, name: Option<String>) -> Parsed<Kind> {
        self.at += 1;
        if self.empty(")")? {
            return Ok(Kind::Struct(name, Vec::new()));
        }
        if self.field_follows()? {
            let mut fields = vec![self.field()?];
            while self.more(')')? {
                fields.push(self.field()?);
            }
            return Ok(Kind::Struct(name, fields));
        }
        let mut items = vec![self.value()?];
        while self.more(')')? {
            items.push(self.value()?);
        }
        Ok(Kind::Tuple(name, items))
    }

    fn field_follows(&mut self) -> Parsed<bool> {
        let start = self.at;
        let found = self.word().is_ok() && {
            self.skip_blank()?;
            self.peek() == Some(':')
        };
        self.at = start;
        Ok(found)
    }

    fn field(&mut self) -> Parsed<Field> {
        let at = self.at;
        let name = self.word()?;
        self.skip_blank()?;
        if !self.take(":") {
            return self.fail("`:` after the name of a field");
        }
        self.skip_blank()?;
        Ok(Field { at, name, value: self.value()? })
    }

    fn list(&mut self) -> Parsed<Kind> {
        self.at += 1;
        let mut items = Vec::new();
        let mut more = !self.empty("]")?;
        while more {
            items.push(self.value()?);
            more = self.more(']')?;
        }
        Ok(Kind::List(items))
    }

    /// No setting is a map, so its entries are read past.
    fn map(&mut self) -> Parsed<Kind> {
        self.at += 1;
        let mut more = !self.empty("}")?;
        while more {
            self.value()?;
            self.skip_blank()?;
            if !self.take(":") {
                return self.fail("`:` between key and value");
            }
            self.skip_blank()?;
            self.value()?;
            more = self.more('}')?;
        }
        Ok(Kind::Map)
    }
}
