//! The text that a scene was read from, and where in it each field stands.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The text that a scene was read from; empty for a scene made by a program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    path: PathBuf,
    text: String,
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The line.
    shown: String,
    /// Characters to point at.
    width: usize,
}

/// An error and the place in a file that it is about.
#[derive(Debug)]
pub struct Located<E> {
    /// The place.
    pub place: Place,
    /// The error.
    pub error: E,
}

impl<E: fmt::Display> fmt::Display for Located<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Place { path, line, column, shown, width } = &self.place;
        let number = line.to_string();
        let (margin, indent) = (" ".repeat(number.len()), " ".repeat(column - 1));
        writeln!(f, "{}:{line}:{column}: {}", path.display(), self.error)?;
        writeln!(f, "{margin} |\n{number} | {shown}")?;
        write!(f, "{margin} | {indent}{}", "^".repeat(*width))
    }
}

impl<E: fmt::Display + fmt::Debug> std::error::Error for Located<E> {}

/// One key of a table or item of a list, with all that stands above it.
struct Entry {
    /// Dotted, items in brackets: `motion.path[2].time_s`.
    path: String,
    /// The key; of an item the item.
    key: Range<usize>,
    /// What it says; of a table its heading.
    value: Range<usize>,
    /// The text of a string or number.
    word: Option<String>,
    /// Items of a list.
    len: Option<usize>,
}

impl Origin {
    /// The text of the file at `path`.
    #[must_use]
    pub fn new(path: &Path, text: String) -> Self {
        Self { path: path.into(), text }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The text.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Where a field stands, or else the innermost table above it that the file
    /// has; `None` if the file says nothing of it.
    #[must_use]
    pub fn find(&self, field: &str) -> Option<Place> {
        let entries = self.entries();
        let mut wanted = field;
        loop {
            if let Some(entry) = entries.iter().find(|e| e.path == wanted) {
                let leaf = wanted.len() == field.len();
                return Some(self.place(if leaf { &entry.value } else { &entry.key }));
            }
            wanted = &wanted[..wanted.rfind(['.', '['])?];
        }
    }

    /// Whether the file says what a field is.
    #[must_use]
    pub fn has(&self, field: &str) -> bool {
        self.entries().iter().any(|e| e.path == field)
    }

    /// Field and place that a parser's message with this span is about. Of what
    /// is read by `kind` or `shape` the parser knows the table alone; the word that
    /// it complains of is looked up there.
    pub(super) fn blamed(
        &self,
        span: Option<Range<usize>>,
        message: &str,
    ) -> Option<(String, Place)> {
        let span = span.filter(|s| !s.is_empty())?;
        let entries = self.entries();
        let Some(outer) = entries.iter().find(|e| e.key == span || e.value == span) else {
            // The text is no TOML, or the span is part of a value.
            return Some((String::new(), self.place(&span)));
        };
        let complaint = Complaint::new(message);
        let mut inner = entries.iter().filter(|e| {
            let below = e.path.strip_prefix(&outer.path);
            below.is_some_and(|rest| rest.starts_with(['.', '['])) && complaint.is_about(e)
        });
        let found = match (inner.next(), inner.next()) {
            (Some(only), None) => only,
            _ => outer,
        };
        let range = if complaint.of_key || found.path == outer.path && outer.key == span {
            &found.key
        } else {
            &found.value
        };
        Some((found.path.clone(), self.place(range)))
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries = Vec::new();
        if let Ok(table) = DeTable::parse(&self.text) {
            list_table(&self.text, table.get_ref(), "", &mut entries);
        }
        entries
    }

    fn place(&self, range: &Range<usize>) -> Place {
        let before = self.text.get(..range.start).unwrap_or("");
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        let shown = self.text[start..].lines().next().unwrap_or("").to_owned();
        let column = before[start..].chars().count() + 1;
        let width = self.text.get(range.clone()).and_then(|s| s.lines().next()).unwrap_or("");
        Place {
            path: self.path.clone(),
            line: before.matches('\n').count() + 1,
            column,
            shown,
            width: width.chars().count().max(1),
        }
    }
}

fn list_table(text: &str, table: &DeTable<'_>, above: &str, entries: &mut Vec<Entry>) {
    for (key, value) in table.iter() {
        let dot = if above.is_empty() { "" } else { "." };
        let path = format!("{above}{dot}{}", key.get_ref());
        list_value(text, &path, key.span(), value, entries);
    }
}

fn list_value(
    text: &str,
    path: &str,
    key: Range<usize>,
    value: &Spanned<DeValue<'_>>,
    entries: &mut Vec<Entry>,
) {
    let len = if let DeValue::Array(items) = value.get_ref() { Some(items.len()) } else { None };
    let word = match value.get_ref() {
        DeValue::String(s) => Some(s.to_string()),
        DeValue::Array(_) | DeValue::Table(_) => None,
        _ => text.get(value.span()).map(str::to_owned),
    };
    entries.push(Entry { path: path.into(), key, value: value.span(), word, len });
    match value.get_ref() {
        DeValue::Table(table) => list_table(text, table, path, entries),
        DeValue::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                list_value(text, &format!("{path}[{i}]"), item.span(), item, entries);
            }
        }
        _ => {}
    }
}

/// What a parser's message says is wrong.
struct Complaint<'a> {
    /// The first word in quotes.
    word: Option<&'a str>,
    /// Whether it is a key.
    of_key: bool,
    /// Length of a list that should have another one.
    len: Option<usize>,
}

impl<'a> Complaint<'a> {
    fn new(message: &'a str) -> Self {
        let quoted = |c: char| message.split(c).nth(1);
        let of_key = message.starts_with("unknown field");
        let lacks = message.starts_with("missing field");
        let len = message.strip_prefix("invalid length ");
        let len = len.and_then(|m| m.split(',').next()?.parse().ok());
        // `invalid type: string "1 mm"`, but `invalid type: integer `3``.
        let quote = message.find(['`', '"', '\'']).and_then(|at| message[at..].chars().next());
        let word = if lacks || len.is_some() { None } else { quote.and_then(quoted) };
        Self { word, of_key, len }
    }

    fn is_about(&self, entry: &Entry) -> bool {
        let key = entry.path.rsplit('.').next();
        match (self.word, self.of_key) {
            (Some(word), true) => key == Some(word),
            (Some(word), false) => entry.word.as_deref() == Some(word),
            (None, _) => self.len.is_some() && entry.len == self.len,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "effects = [\"layers\",\n  \"sound\"]\n[geometry]\nkind = \"fingertip\"\n\
        density = \"huge\"\n[motion]\nincrements = 3\n[[motion.path]]\ntime_s = 1.0\n";

    fn origin() -> Origin {
        Origin::new(Path::new("a.toml"), TEXT.into())
    }

    fn line(field: &str) -> Option<usize> {
        origin().find(field).map(|p| p.line)
    }

    #[test]
    fn a_field_is_found_by_its_path() {
        assert_eq!(line("effects[1]"), Some(2));
        assert_eq!(line("geometry.density"), Some(5));
        assert_eq!(line("motion.path[0].time_s"), Some(9));
        // What is not there is blamed on the table where it would be.
        assert_eq!(line("motion.path[0].depth_mm"), Some(8));
        assert_eq!(line("geometry.shape.nail_mm[1]"), Some(3));
        assert_eq!(line("materials.dermis"), None);
    }

    #[test]
    fn a_word_inside_a_table_is_found() {
        let at = TEXT.find("[geometry]").unwrap();
        let span = Some(at..at + "[geometry]".len());
        let (field, place) =
            origin().blamed(span.clone(), "unknown variant `huge`, expected `coarse`").unwrap();
        assert_eq!((field.as_str(), place.line, place.column), ("geometry.density", 5, 11));
        let (field, place) =
            origin().blamed(span.clone(), "unknown field `density`, expected `shape`").unwrap();
        assert_eq!((field.as_str(), place.line, place.column), ("geometry.density", 5, 1));
        let (field, place) = origin().blamed(span, "missing field `shape`").unwrap();
        assert_eq!((field.as_str(), place.line), ("geometry", 3));
    }

    #[test]
    fn the_line_is_shown_with_a_mark_under_the_value() {
        let place = origin().find("motion.increments").unwrap();
        let text = Located { place, error: "motion.increments = 3 is odd" }.to_string();
        let shown = "a.toml:7:14: motion.increments = 3 is odd\n  |\n7 | increments = 3\n  |              ^";
        assert_eq!(text, shown);
    }
}
