//! Certificates: the results of a proof, as a text that is checked in another way.

use super::ProofProblem;
use crate::error::{Error, Place, Result};
use std::fmt;
use std::path::Path;

/// Statements of a proof. Its `Display` is the file:
///
/// ```text
/// palpate certificate 1
/// model CHECKSUM
/// ensemble CHECKSUM
/// code CHECKSUM
/// tree ERROR OFFSET SOURCE...
/// table ERROR
/// output ERROR LEAST MOST
/// ```
///
/// `tree` is there for each of the model's trees, in its order: the largest difference of a leaf in the library's margins,
/// what the base has instead of the tree in steps of its leaves, and the ensemble's trees that it stands for, counted from
/// 0. A table has `table` instead. `output` is there for each output: the largest difference of its margin, and the ends of
/// its range. Checksums are CRC-64 (XZ) of the files; `code` is there for a model whose trees are assembly.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certificate {
    /// Checksum of the model's bytes.
    pub model: u64,
    /// Checksum of the ensemble's file.
    pub ensemble: u64,
    /// Checksum of the file of assembly, if trees are in one.
    pub code: Option<u64>,
    /// The model's trees.
    pub trees: Vec<CertifiedTree>,
    /// The largest difference in a cell, if the model is a table.
    pub table: Option<f64>,
    /// The outputs: largest difference, least and most margin.
    pub outputs: Vec<[f64; 3]>,
}

/// A tree of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct CertifiedTree {
    /// The largest difference of a leaf.
    pub error: f64,
    /// Amount that the base margin has instead of this tree, in steps of its leaves.
    pub offset: i32,
    /// The ensemble's trees that it stands for.
    pub sources: Vec<usize>,
}

const FIRST: &str = "palpate certificate 1";

impl fmt::Display for Certificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{FIRST}\nmodel {:016x}\nensemble {:016x}", self.model, self.ensemble)?;
        if let Some(code) = self.code {
            writeln!(f, "code {code:016x}")?;
        }
        for CertifiedTree { error, offset, sources } in &self.trees {
            write!(f, "tree {error:e} {offset}")?;
            sources.iter().try_for_each(|source| write!(f, " {source}"))?;
            writeln!(f)?;
        }
        if let Some(error) = self.table {
            writeln!(f, "table {error:e}")?;
        }
        self.outputs.iter().try_for_each(|[error, least, most]| writeln!(f, "output {error:e} {least:e} {most:e}"))
    }
}

impl Certificate {
    /// Reads a certificate.
    ///
    /// # Errors
    /// [`Error::Io`], and [`ProofProblem::Line`] for a line that does not belong in a certificate.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|source| Error::io(path, "read the certificate", source))?;
        Self::parse(&text).map_err(|(line, problem)| Error::at(Place::line(path, line), problem))
    }

    /// Reads a certificate's text; an error has the number of the line.
    pub(super) fn parse(text: &str) -> Result<Self, (u64, ProofProblem)> {
        let mut certificate = Self::default();
        let mut lines = text.lines().zip(1..);
        match lines.next() {
            Some((FIRST, _)) => {}
            other => return Err((1, problem(other.map_or("", |(line, _)| line)))),
        }
        for (line, number) in lines {
            certificate.line(line).ok_or_else(|| (number, problem(line)))?;
        }
        Ok(certificate)
    }

    fn line(&mut self, line: &str) -> Option<()> {
        let mut words = line.split_ascii_whitespace();
        match words.next()? {
            "model" => self.model = u64::from_str_radix(words.next()?, 16).ok()?,
            "ensemble" => self.ensemble = u64::from_str_radix(words.next()?, 16).ok()?,
            "code" => self.code = Some(u64::from_str_radix(words.next()?, 16).ok()?),
            "tree" => {
                let (error, offset) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
                let sources: Option<Vec<usize>> = words.by_ref().map(|word| word.parse().ok()).collect();
                self.trees.push(CertifiedTree { error, offset, sources: sources? });
            }
            "table" => self.table = Some(words.next()?.parse().ok()?),
            "output" => {
                let mut next = || words.next()?.parse::<f64>().ok();
                self.outputs.push([next()?, next()?, next()?]);
            }
            _ => return None,
        }
        words.next().is_none().then_some(())
    }
}

fn problem(line: &str) -> ProofProblem {
    ProofProblem::Line { line: line.chars().take(80).collect() }
}
