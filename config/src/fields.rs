//! Settings out of a tree: each asked for by name, type, range and default.
//!
//! In:    a [`Node`] and what it should be.
//! Out:   the value, the default if it is absent, or `None` once a fault has been noted.
//! Keeps: the faults so far, so that one wrong setting hides no other.
//! Not here: which settings there are (`scene`).

use crate::fault::{Fault, FaultKind};
use crate::node::{Field, Kind, Node};
use std::fmt::Display;
use std::ops::RangeInclusive;

/// Longest piece of the file that a fault repeats, in characters.
const QUOTE_MAX: usize = 40;

/// Name and fields of one kind of struct: the written format.
pub(crate) struct Shape {
    /// May stand before the bracket.
    pub name: &'static str,
    pub fields: &'static [&'static str],
}

/// The fields of one struct of the file; none of them if the struct was left out.
pub(crate) struct Group<'t> {
    pub path: String,
    pub at: usize,
    fields: &'t [Field],
}

/// Collects faults while values are asked for.
pub(crate) struct Reader<'t> {
    text: &'t str,
    faults: Vec<(usize, String, FaultKind)>,
}

impl<'t> Group<'t> {
    /// A struct that was left out of the one at `at`: all its settings are at their defaults.
    pub(crate) fn absent(path: String, at: usize) -> Self {
        Self { path, at, fields: &[] }
    }

    /// The value of a field, if it is there.
    pub(crate) fn get(&self, name: &str) -> Option<&'t Node> {
        self.fields.iter().find(|field| field.name == name).map(|field| &field.value)
    }

    /// The full path of a field.
    pub(crate) fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }
}

impl<'t> Reader<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        Self { text, faults: Vec::new() }
    }

    /// Notes a fault at a byte of the file.
    pub(crate) fn fault(&mut self, at: usize, path: impl Into<String>, what: FaultKind) {
        self.faults.push((at, path.into(), what));
    }

    /// All faults, first line first.
    pub(crate) fn into_faults(mut self) -> Vec<Fault> {
        self.faults.sort_by_key(|(at, _, _)| *at);
        let text = self.text;
        let fault = |(at, path, what)| {
            let (line, column) = line_and_column(text, at);
            Fault { line, column, path, what }
        };
        self.faults.into_iter().map(fault).collect()
    }

    /// Notes that a value of the right kind cannot be.
    pub(crate) fn out_of_range(&mut self, node: &Node, path: &str, allowed: String) {
        let found = self.quote(node);
        self.fault(node.at, path, FaultKind::OutOfRange { found, allowed });
    }

    /// Notes a value of the wrong kind, unless it has been reported as no value at all.
    pub(crate) fn wrong_type(&mut self, node: &Node, path: &str, expected: &str) {
        let named = |name: &Option<String>, what: &str| match name {
            Some(name) => format!("{name}(…)"),
            None => what.to_owned(),
        };
        let found = match &node.kind {
            Kind::Broken => return,
            Kind::Struct(name, _) => named(name, "a struct"),
            Kind::Tuple(name, _) => named(name, "a tuple"),
            Kind::List(_) => "a list".into(),
            Kind::Map => "a map".into(),
            Kind::Text(_) => format!("the text {}", self.quote(node)),
            Kind::Char => format!("the character {}", self.quote(node)),
            Kind::Word(_) | Kind::Bool(_) => self.quote(node),
            Kind::Whole { .. } | Kind::Decimal(_) => format!("the number {}", self.quote(node)),
        };
        self.fault(node.at, path, FaultKind::WrongType { found, expected: expected.into() });
    }

    /// Notes that a field without a default is not there.
    pub(crate) fn missing(&mut self, group: &Group, name: &str, expected: &str) {
        let what = FaultKind::Missing { expected: expected.into() };
        self.fault(group.at, group.path_of(name), what);
    }

    /// The fields of a struct, of which unknown and repeated ones are noted.
    pub(crate) fn group(&mut self, node: &'t Node, path: &str, shape: &Shape) -> Option<Group<'t>> {
        let expected = format!("{}({}: …)", shape.name, shape.fields.join(": …, "));
        let Kind::Struct(name, fields) = &node.kind else {
            self.wrong_type(node, path, &expected);
            return None;
        };
        if name.as_ref().is_some_and(|name| name != shape.name) {
            self.wrong_type(node, path, &expected);
        }
        let group = Group { path: path.to_owned(), at: node.at, fields };
        self.check_names(&group, shape);
        Some(group)
    }

    fn check_names(&mut self, group: &Group, shape: &Shape) {
        for (i, field) in group.fields.iter().enumerate() {
            let path = group.path_of(&field.name);
            if !shape.fields.contains(&field.name.as_str()) {
                let (name, known) = (field.name.clone(), shape.fields);
                self.fault(field.at, path, FaultKind::UnknownField { name, known });
            } else if let Some(first) = group.fields[..i].iter().find(|f| f.name == field.name) {
                let (first_line, first_column) = line_and_column(self.text, first.at);
                let what = FaultKind::DuplicateField { first_line, first_column };
                self.fault(field.at, path, what);
            }
        }
    }

    /// A struct inside a struct; one that is left out has no fields.
    pub(crate) fn part(
        &mut self,
        group: &Group<'t>,
        name: &str,
        shape: &Shape,
    ) -> Option<Group<'t>> {
        let path = group.path_of(name);
        match group.get(name) {
            Some(node) => self.group(node, &path, shape),
            None => Some(Group::absent(path, group.at)),
        }
    }

    /// A number with a default.
    pub(crate) fn number(
        &mut self,
        group: &Group,
        name: &str,
        range: RangeInclusive<f64>,
        default: f64,
    ) -> Option<f64> {
        let Some(node) = group.get(name) else { return Some(default) };
        self.number_in(node, &group.path_of(name), range)
    }

    /// A number that has no default.
    pub(crate) fn required_number(
        &mut self,
        group: &Group,
        name: &str,
        range: RangeInclusive<f64>,
    ) -> Option<f64> {
        if let Some(node) = group.get(name) {
            return self.number_in(node, &group.path_of(name), range);
        }
        self.missing(group, name, &format!("a number, {}", words(&range)));
        None
    }

    /// The number that `node` is. Neither `NaN` nor an infinity is in any range.
    pub(crate) fn number_in(
        &mut self,
        node: &Node,
        path: &str,
        range: RangeInclusive<f64>,
    ) -> Option<f64> {
        let value = match node.kind {
            Kind::Whole { value, decimal: true } => value as f64,
            Kind::Decimal(value) => value,
            _ => {
                self.wrong_type(node, path, &format!("a number, {}", words(&range)));
                return None;
            }
        };
        if range.contains(&value) {
            return Some(value);
        }
        self.out_of_range(node, path, words(&range));
        None
    }

    /// A whole number with a default.
    pub(crate) fn whole<T>(
        &mut self,
        group: &Group,
        name: &str,
        range: RangeInclusive<T>,
        default: T,
    ) -> Option<T>
    where
        T: TryFrom<i128> + PartialOrd + Display,
    {
        let Some(node) = group.get(name) else { return Some(default) };
        let Kind::Whole { value, .. } = node.kind else {
            let expected = format!("a whole number, {}", words(&range));
            self.wrong_type(node, &group.path_of(name), &expected);
            return None;
        };
        let fitting = T::try_from(value).ok().filter(|value| range.contains(value));
        if fitting.is_none() {
            self.out_of_range(node, &group.path_of(name), words(&range));
        }
        fitting
    }

    /// `true` or `false`, with a default.
    pub(crate) fn switch(&mut self, group: &Group, name: &str, default: bool) -> Option<bool> {
        match group.get(name) {
            None => Some(default),
            Some(Node { kind: Kind::Bool(value), .. }) => Some(*value),
            Some(node) => {
                self.wrong_type(node, &group.path_of(name), "true or false");
                None
            }
        }
    }

    /// The items of a list, or `None` if it was left out or is no list.
    pub(crate) fn list(
        &mut self,
        group: &Group<'t>,
        name: &str,
        expected: &str,
    ) -> Option<&'t [Node]> {
        let node = group.get(name)?;
        if let Kind::List(items) = &node.kind {
            return Some(items);
        }
        self.wrong_type(node, &group.path_of(name), expected);
        None
    }

    /// The variant that `node` names, one of `known`.
    pub(crate) fn variant(
        &mut self,
        node: &Node,
        path: &str,
        known: &'static [&'static str],
    ) -> Option<&'static str> {
        self.named(node, path, known.to_vec()).map(|i| known[i])
    }

    /// One of some names that stand alone; the first if it is left out.
    pub(crate) fn choice<T: Copy>(
        &mut self,
        group: &Group,
        name: &str,
        known: &'static [(&'static str, T)],
    ) -> Option<T> {
        let Some(node) = group.get(name) else { return Some(known[0].1) };
        let path = group.path_of(name);
        let names = known.iter().map(|(name, _)| *name).collect();
        let (_, value) = known[self.named(node, &path, names)?];
        self.plain(node, &path, value)
    }

    /// The value of a variant without fields.
    pub(crate) fn plain<T>(&mut self, node: &Node, path: &str, value: T) -> Option<T> {
        if let Kind::Word(_) = node.kind {
            return Some(value);
        }
        self.wrong_type(node, path, "the name alone");
        None
    }

    /// Notes a list that is too short or too long.
    pub(crate) fn counted(
        &mut self,
        group: &Group,
        name: &str,
        count: usize,
        [least, most]: [usize; 2],
    ) {
        let listed = group.get(name).filter(|_| !(least..=most).contains(&count));
        let Some(list) = listed else { return };
        let what = FaultKind::OutOfRange {
            found: format!("a list of {count}"),
            allowed: format!("a list of {}", words(&(least..=most))),
        };
        self.fault(list.at, group.path_of(name), what);
    }

    /// Which of the names `node` has.
    fn named(&mut self, node: &Node, path: &str, known: Vec<&'static str>) -> Option<usize> {
        let (Kind::Word(name) | Kind::Struct(Some(name), _) | Kind::Tuple(Some(name), _)) =
            &node.kind
        else {
            self.wrong_type(node, path, &format!("one of {}", known.join(", ")));
            return None;
        };
        let variant = known.iter().position(|known| *known == name);
        if variant.is_none() {
            let what = FaultKind::UnknownVariant { name: name.clone(), known };
            self.fault(node.at, path, what);
        }
        variant
    }

    /// The text of a value as it stands in the file.
    fn quote(&self, node: &Node) -> String {
        let text = &self.text[node.at..node.end];
        let mut quote: String = text.chars().take(QUOTE_MAX).map(printable).collect();
        if text.chars().nth(QUOTE_MAX).is_some() {
            quote.push('…');
        }
        quote
    }
}

/// Keeps a fault on one line and a terminal unharmed.
fn printable(c: char) -> char {
    if c.is_control() { ' ' } else { c }
}

/// A range in words.
pub(crate) fn words<T: Display>(range: &RangeInclusive<T>) -> String {
    format!("{} to {}", range.start(), range.end())
}

fn line_and_column(text: &str, at: usize) -> (u32, u32) {
    let before = &text[..at];
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    let line = before.matches('\n').count() + 1;
    let column = before[line_start..].chars().count() + 1;
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    (count(line), count(column))
}
