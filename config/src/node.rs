//! What a scene file's text becomes: a tree of values that remember where they stood.
//!
//! In:    built by `tree`.
//! Out:   [`Node`], [`Kind`], [`Field`].
//! Keeps: nothing.
//! Not here: what a scene may hold (`scene`).

/// One value and the bytes `at..end` that it was read from.
pub(crate) struct Node {
    pub at: usize,
    pub end: usize,
    pub kind: Kind,
}

/// What a value is, before anyone asks what it should be.
pub(crate) enum Kind {
    /// A bare name: a unit variant or `None`.
    Word(String),
    /// `Name(a: 1)`, `(a: 1)` or empty brackets.
    Struct(Option<String>, Vec<Field>),
    /// `Name(1, 2)` or `(1, 2)`, never empty.
    Tuple(Option<String>, Vec<Node>),
    List(Vec<Node>),
    Map,
    Text(String),
    Char,
    Bool(bool),
    /// A whole number; `ron` takes only those in decimal digits where a float is wanted.
    Whole {
        value: i128,
        decimal: bool,
    },
    /// Any other number, `inf` and `NaN` among them.
    Decimal(f64),
    /// Already reported.
    Broken,
}

/// One `name: value`.
pub(crate) struct Field {
    pub at: usize,
    pub name: String,
    pub value: Node,
}
