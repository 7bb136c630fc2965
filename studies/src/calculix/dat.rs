//! Reads what `*NODE PRINT`, `*EL PRINT` and `*CONTACT PRINT` put into a `.dat` file.

use std::path::{Path, PathBuf};

/// What a table of a `.dat` file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Displacement of a node, mm.
    Displacement,
    /// Reaction of a node, N.
    Force,
    /// Sum of the reactions of a set of nodes, N; one row.
    TotalForce,
    /// Strain at an integration point: xx, yy, zz, xy, xz, yz, tensor components;
    /// Green strain in a geometrically nonlinear step.
    Strain,
    /// Cauchy stress at an integration point, MPa, components as of the strain.
    Stress,
    /// Overlap (positive) and relative tangential displacements, mm.
    ContactDisplacement,
    /// Pressure (positive) and tangential tractions, MPa.
    ContactStress,
}

/// How a table announces itself, how many numbers name a row, how many follow.
const HEADINGS: [(&str, Quantity, usize, usize); 9] = [
    ("displacements (vx,vy,vz)", Quantity::Displacement, 1, 3),
    ("forces (fx,fy,fz)", Quantity::Force, 1, 3),
    ("total force (fx,fy,fz)", Quantity::TotalForce, 0, 3),
    ("strains (elem,", Quantity::Strain, 2, 6),
    ("stresses (elem,", Quantity::Stress, 2, 6),
    ("relative contact displacement (slave node", Quantity::ContactDisplacement, 1, 3),
    ("relative contact displacement (slave element", Quantity::ContactDisplacement, 2, 3),
    ("contact stress (slave node", Quantity::ContactStress, 1, 3),
    ("contact stress (slave element", Quantity::ContactStress, 2, 3),
];

/// One row of a [`Table`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Number of the node or element, from 1; 0 in a total.
    pub id: usize,
    /// Integration point, or face of a contact element, from 1; 0 if there is none.
    pub part: usize,
    /// Components; those that the quantity does not have are 0.
    pub values: [f64; 6],
}

/// One printed table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What it holds.
    pub quantity: Quantity,
    /// Set that it was printed for; empty for contact.
    pub set: String,
    /// Load fraction.
    pub time: f64,
    /// Its rows in the order of the file.
    pub rows: Vec<Row>,
}

/// A `.dat` file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dat {
    /// Every table that this reader knows, in the order of the file.
    pub tables: Vec<Table>,
}

/// Why a `.dat` file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum DatError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A line is not what its table announced.
    #[error("line {line}: '{text}' is not a row of a table of {quantity:?}")]
    Row {
        /// Line, from 1.
        line: usize,
        /// Its text.
        text: String,
        /// What the table holds.
        quantity: Quantity,
    },
    /// A heading without a time.
    #[error("line {line}: heading '{text}' does not end with a time")]
    Heading {
        /// Line, from 1.
        line: usize,
        /// Its text.
        text: String,
    },
    /// CalculiX printed no such table at that time: it stopped before.
    #[error("no table of {quantity:?} for set '{set}' at time {time}; CalculiX stopped before")]
    Missing {
        /// What was wanted.
        quantity: Quantity,
        /// Its set.
        set: String,
        /// Load fraction.
        time: f64,
    },
}

impl Dat {
    /// Reads a file.
    ///
    /// # Errors
    /// [`DatError`] names the file, or the line.
    pub fn read(path: &Path) -> Result<Self, DatError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| DatError::Io { path: path.into(), source })?;
        Self::parse(&text)
    }

    /// Reads the text of a file. Tables of unknown quantities are passed over.
    ///
    /// # Errors
    /// [`DatError`] names the line.
    pub fn parse(text: &str) -> Result<Self, DatError> {
        let mut dat = Self::default();
        let mut shape = None;
        for (i, line) in text.lines().enumerate() {
            let content = line.trim();
            if content.is_empty() {
                continue;
            }
            if content.starts_with(|c: char| c.is_ascii_alphabetic()) && !content.starts_with("NaN")
            {
                let found = HEADINGS.iter().find(|h| content.starts_with(h.0));
                shape = found.map(|&(_, quantity, names, values)| (quantity, names, values));
                if let Some((quantity, ..)) = shape {
                    let bad = || DatError::Heading { line: i + 1, text: content.into() };
                    let (head, time) = content.rsplit_once("time").ok_or_else(bad)?;
                    let time = time.trim().parse().map_err(|_| bad())?;
                    let set = head.rsplit_once("for set ").map_or("", |(_, set)| set);
                    let set = set.split_whitespace().next().unwrap_or("").to_owned();
                    dat.tables.push(Table { quantity, set, time, rows: Vec::new() });
                }
            } else if let (Some((quantity, names, values)), Some(table)) =
                (shape, dat.tables.last_mut())
            {
                let row = row(content, names, values).ok_or_else(|| DatError::Row {
                    line: i + 1,
                    text: content.into(),
                    quantity,
                })?;
                table.rows.push(row);
            }
        }
        Ok(dat)
    }

    /// The table of a quantity for a set (empty for contact) at a load fraction.
    ///
    /// # Errors
    /// [`DatError::Missing`].
    pub fn table(&self, quantity: Quantity, set: &str, time: f64) -> Result<&Table, DatError> {
        // Times are printed with seven digits.
        let wanted = |t: &&Table| {
            t.quantity == quantity
                && t.set.eq_ignore_ascii_case(set)
                && (t.time - time).abs() <= 1e-6 * time.abs()
        };
        self.tables.iter().find(wanted).ok_or_else(|| DatError::Missing {
            quantity,
            set: set.into(),
            time,
        })
    }
}

/// A row of `names` integers and `values` finite numbers.
fn row(text: &str, names: usize, values: usize) -> Option<Row> {
    let mut fields = text.split_whitespace();
    let mut row = Row { id: 0, part: 0, values: [0.0; 6] };
    for name in [&mut row.id, &mut row.part].into_iter().take(names) {
        *name = fields.next()?.parse().ok()?;
    }
    for value in &mut row.values[..values] {
        *value = real(fields.next()?)?;
    }
    // A local axis system may follow.
    Some(row)
}

/// A finite number as Fortran prints it: three digits of exponent push out the `E`.
fn real(text: &str) -> Option<f64> {
    let value: f64 = text.parse().ok().or_else(|| {
        let sign = text[1..].rfind(['+', '-'])? + 1;
        format!("{}E{}", &text[..sign], &text[sign..]).parse().ok()
    })?;
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "
 displacements (vx,vy,vz) for set NBODY and time  0.1000000E+01

         1 -1.000000E-03  2.000000E+00  0.000000E+00
         2  1.000000-101  0.000000E+00  0.000000E+00

 total force (fx,fy,fz) for set NINDENTER and time  0.1000000E+01

        1.234567E+00 -2.000000E-05  3.000000E+00

 strains (elem, integ.pnt.,exx,eyy,ezz,exy,exz,eyz) for set EBODY and time  0.1000000E+01

         7   2  1.000000E-01  2.000000E-01  3.000000E-01  4.000000E-01  5.000000E-01  6.000000E-01

 internal energy density (elem, integ.pnt.,ener) for set EBODY and time  0.1000000E+01

         7   2  9.000000E-01

 contact stress (slave element+face,press,tang1,tang2) for all contact elements and time 0.1000000E+01

         3          2  1.500000E-02  0.000000E+00  0.000000E+00
";

    #[test]
    fn tables_are_read_with_their_set_and_time() {
        let dat = Dat::parse(TEXT).unwrap();
        assert_eq!(dat.tables.len(), 4);
        let u = dat.table(Quantity::Displacement, "nbody", 1.0).unwrap();
        assert_eq!((u.rows[1].id, u.rows[1].values[0]), (2, 1e-101));
        let force = dat.table(Quantity::TotalForce, "NINDENTER", 1.0).unwrap();
        assert_eq!(force.rows[0].values[..3].to_vec(), [1.234567, -2e-5, 3.0]);
        let strain = dat.table(Quantity::Strain, "EBODY", 1.0).unwrap();
        assert_eq!((strain.rows[0].id, strain.rows[0].part), (7, 2));
        assert_eq!(strain.rows[0].values.to_vec(), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
        let contact = dat.table(Quantity::ContactStress, "", 1.0).unwrap();
        assert_eq!((contact.rows[0].id, contact.rows[0].part), (3, 2));
    }

    #[test]
    fn what_is_missing_or_broken_is_named() {
        let dat = Dat::parse(TEXT).unwrap();
        let missing = dat.table(Quantity::Stress, "EBODY", 1.0);
        assert!(matches!(missing, Err(DatError::Missing { .. })));
        for (from, to) in [("  2.000000E+00", "  NaN"), ("2.000000E-01", "")] {
            let broken = Dat::parse(&TEXT.replacen(from, to, 1));
            assert!(matches!(broken, Err(DatError::Row { .. })), "{to}");
        }
        let broken = Dat::parse(&TEXT.replacen("time  0.1000000E+01", "time", 1));
        assert!(matches!(broken, Err(DatError::Heading { line: 2, .. })));
        assert!(matches!(Dat::read(Path::new("none.dat")), Err(DatError::Io { .. })));
    }
}
