//! The text of an ASCII MSH 4.1 file as plain records.
//!
//! Grammar: Gmsh reference manual, 'MSH file format'. Sections that a mesh does
//! not need are skipped.

use super::GmshError;
use std::collections::HashMap;

/// Dimension and tag of a geometric entity or physical group.
pub(super) type Key = (u8, i32);

/// What the file says, not yet judged.
#[derive(Debug, Default)]
pub(super) struct Raw {
    /// Name and its line, by dimension and tag of the group.
    pub names: HashMap<Key, (String, usize)>,
    /// Physical groups of each entity.
    pub groups: HashMap<Key, Vec<i32>>,
    /// Node positions, mm.
    pub positions: Vec<[f64; 3]>,
    /// Index of each node tag.
    pub node_of_tag: HashMap<u64, u32>,
    /// Elements by entity and type.
    pub blocks: Vec<RawBlock>,
}

/// Elements of one type on one entity.
#[derive(Debug)]
pub(super) struct RawBlock {
    pub line: usize,
    pub entity: Key,
    pub element_type: u32,
    /// Line, tag, node tags.
    pub elements: Vec<(usize, u64, Vec<u64>)>,
}

/// Lines with their numbers, blank ones skipped.
struct Lines<'a> {
    rest: std::iter::Enumerate<std::str::Lines<'a>>,
    section: String,
}

/// Words of one line.
struct Words<'a> {
    line: usize,
    rest: std::str::SplitAsciiWhitespace<'a>,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<(usize, &'a str)> {
        self.rest.by_ref().map(|(i, l)| (i + 1, l.trim())).find(|(_, l)| !l.is_empty())
    }

    fn line(&mut self) -> Result<(usize, &'a str), GmshError> {
        self.next().ok_or_else(|| GmshError::Truncated { section: self.section.clone() })
    }

    fn words(&mut self) -> Result<Words<'a>, GmshError> {
        let (line, text) = self.line()?;
        Ok(Words { line, rest: text.split_ascii_whitespace() })
    }

    /// The line that ends the section.
    fn end(&mut self) -> Result<(), GmshError> {
        let (line, text) = self.line()?;
        match text.strip_prefix("$End") {
            Some(name) if name == self.section => Ok(()),
            _ => Err(GmshError::Syntax {
                line,
                expected: "the end of the section",
                found: text.into(),
            }),
        }
    }
}

impl Words<'_> {
    fn parse<T: std::str::FromStr>(&mut self, expected: &'static str) -> Result<T, GmshError> {
        let word = self.rest.next().unwrap_or("end of line");
        word.parse().map_err(|_| GmshError::Syntax {
            line: self.line,
            expected,
            found: word.into(),
        })
    }

    fn skip(&mut self, words: usize) -> Result<(), GmshError> {
        for _ in 0..words {
            self.number()?;
        }
        Ok(())
    }

    fn number(&mut self) -> Result<f64, GmshError> {
        let value: f64 = self.parse("a number")?;
        if value.is_finite() {
            Ok(value)
        } else {
            let found = value.to_string();
            Err(GmshError::Syntax { line: self.line, expected: "a finite number", found })
        }
    }

    fn done(&mut self) -> Result<(), GmshError> {
        match self.rest.next() {
            None => Ok(()),
            Some(word) => Err(GmshError::Syntax {
                line: self.line,
                expected: "the end of the line",
                found: word.into(),
            }),
        }
    }
}

/// Reads every section.
pub(super) fn parse(text: &str) -> Result<Raw, GmshError> {
    let mut lines = Lines { rest: text.lines().enumerate(), section: "MeshFormat".into() };
    let mut raw = Raw::default();
    format(&mut lines)?;
    let (mut nodes, mut elements) = (false, false);
    while let Some((line, text)) = lines.next() {
        let Some(name) = text.strip_prefix('$') else {
            return Err(GmshError::Syntax { line, expected: "a $Section", found: text.into() });
        };
        lines.section = name.into();
        match name {
            "PhysicalNames" => physical_names(&mut lines, &mut raw)?,
            "Entities" => entities(&mut lines, &mut raw)?,
            "Nodes" => {
                nodes = true;
                read_nodes(&mut lines, &mut raw)?;
            }
            "Elements" => {
                elements = true;
                read_elements(&mut lines, &mut raw)?;
            }
            "PartitionedEntities" => {
                return Err(GmshError::Syntax {
                    line,
                    expected: "a mesh without partitions (gmsh: Mesh > Unpartition)",
                    found: text.into(),
                });
            }
            _ => {
                let end = format!("$End{name}");
                while lines.line()?.1 != end {}
                continue;
            }
        }
        lines.end()?;
    }
    let missing = |section| GmshError::MissingSection { section, hint: "is it a mesh at all?" };
    if !nodes {
        return Err(missing("Nodes"));
    }
    if !elements {
        return Err(missing("Elements"));
    }
    Ok(raw)
}

fn format(lines: &mut Lines<'_>) -> Result<(), GmshError> {
    let hint = "it is not a Gmsh mesh";
    let missing = GmshError::MissingSection { section: "MeshFormat", hint };
    match lines.next() {
        Some((_, "$MeshFormat")) => {}
        _ => return Err(missing),
    }
    let mut words = lines.words()?;
    let line = words.line;
    let version: String = words.parse("a version")?;
    if version != "4.1" {
        return Err(GmshError::Version { line, found: version });
    }
    if words.parse::<u32>("0 for ASCII or 1 for binary")? != 0 {
        return Err(GmshError::Binary { line });
    }
    lines.end()
}

fn physical_names(lines: &mut Lines<'_>, raw: &mut Raw) -> Result<(), GmshError> {
    let count: usize = lines.words()?.parse("the number of names")?;
    for _ in 0..count {
        let (line, text) = lines.line()?;
        let bad = |expected| GmshError::Syntax { line, expected, found: text.into() };
        // The name is quoted and may hold blanks.
        let (head, name) = text.split_once('"').ok_or_else(|| bad("a name in quotes"))?;
        let name = name.strip_suffix('"').ok_or_else(|| bad("a closing quote"))?;
        let mut words = Words { line, rest: head.split_ascii_whitespace() };
        let key = (words.parse("a dimension")?, words.parse("a group tag")?);
        raw.names.insert(key, (name.into(), line));
    }
    Ok(())
}

fn entities(lines: &mut Lines<'_>, raw: &mut Raw) -> Result<(), GmshError> {
    let mut words = lines.words()?;
    let mut counts = [0usize; 4];
    for c in &mut counts {
        *c = words.parse("a number of entities")?;
    }
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let mut words = lines.words()?;
            let tag = words.parse("an entity tag")?;
            // A point has coordinates, the others a bounding box.
            words.skip(if dimension == 0 { 3 } else { 6 })?;
            let groups: usize = words.parse("a number of physical groups")?;
            let mut list = Vec::new();
            for _ in 0..groups {
                // Gmsh writes a group whose orientation is reversed as negative.
                let tag: i32 = words.parse("a group tag")?;
                list.push(tag.saturating_abs());
            }
            raw.groups.insert((dimension as u8, tag), list);
        }
    }
    Ok(())
}

fn read_nodes(lines: &mut Lines<'_>, raw: &mut Raw) -> Result<(), GmshError> {
    let blocks: usize = lines.words()?.parse("the number of node blocks")?;
    for _ in 0..blocks {
        let mut words = lines.words()?;
        let dimension: usize = words.parse("a dimension")?;
        let _entity: i32 = words.parse("an entity tag")?;
        let parametric: u8 = words.parse("0 or 1")?;
        let count: usize = words.parse("a number of nodes")?;
        let mut tags = Vec::new();
        for _ in 0..count {
            let mut words = lines.words()?;
            tags.push((words.line, words.parse::<u64>("a node tag")?));
            words.done()?;
        }
        for (line, tag) in tags {
            let mut words = lines.words()?;
            let mut position = [0.0; 3];
            for x in &mut position {
                *x = words.number()?;
            }
            if parametric == 0 {
                words.done()?;
            } else {
                words.skip(dimension)?;
            }
            let index = u32::try_from(raw.positions.len()).unwrap_or(u32::MAX);
            if raw.node_of_tag.insert(tag, index).is_some() {
                return Err(GmshError::DuplicateNode { line, tag });
            }
            raw.positions.push(position);
        }
    }
    Ok(())
}

fn read_elements(lines: &mut Lines<'_>, raw: &mut Raw) -> Result<(), GmshError> {
    let blocks: usize = lines.words()?.parse("the number of element blocks")?;
    for _ in 0..blocks {
        let mut words = lines.words()?;
        let line = words.line;
        let entity = (words.parse("a dimension")?, words.parse("an entity tag")?);
        let element_type = words.parse("an element type")?;
        let count: usize = words.parse("a number of elements")?;
        let mut elements = Vec::new();
        for _ in 0..count {
            let mut words = lines.words()?;
            let tag = words.parse("an element tag")?;
            let mut nodes = Vec::new();
            while let Some(word) = words.rest.next() {
                let node = word.parse().map_err(|_| GmshError::Syntax {
                    line: words.line,
                    expected: "a node tag",
                    found: word.into(),
                })?;
                nodes.push(node);
            }
            elements.push((words.line, tag, nodes));
        }
        raw.blocks.push(RawBlock { line, entity, element_type, elements });
    }
    Ok(())
}
