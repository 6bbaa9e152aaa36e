//! Every trial's estimates as a Parquet file, for who wants distributions instead of moments.
//!
//! A Parquet file is readable only when it is whole, so trials are first appended to a spool (`spool.rs`). At
//! the end it becomes `trials.parquet`: a row a trial, method and parameter, in that order, with the number
//! of its point, counted from 1, and its levels. The `parquet` crate (Apache Arrow's own) writes it, without
//! its compressors: estimates are noise, and noise does not compress.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use scenario::Level;

use super::plan::{SweepPlan, TRACKED};
use super::result::SweepResult;
use super::spool::{RECORD, failed};
use crate::error::BenchError;

/// The rows' file in the folder of results.
const ROWS_FILE: &str = "trials.parquet";

/// Trials whose rows are held together: a row group.
const TRIALS_PER_GROUP: u64 = 1 << 14;

/// Writes `trials.parquet` into `out` from spools that follow each other.
pub(super) fn write_rows(
    plan: &SweepPlan,
    result: &SweepResult,
    spools: &[PathBuf],
    out: &Path,
) -> Result<(), BenchError> {
    let path = out.join(ROWS_FILE);
    let staged = atomic_file::stage(&path, b"").map_err(|error| failed(&path, &error))?;
    let mut input: Box<dyn Read> = Box::new(std::io::empty());
    for spool in spools {
        let file = File::open(spool).map_err(|error| failed(spool, &error))?;
        input = Box::new(input.chain(BufReader::new(file)));
    }
    let schema = Arc::new(schema(result).map_err(|error| failed(&path, &error))?);
    let properties = Arc::new(WriterProperties::builder().build());
    let write = || -> Result<(), Box<dyn std::error::Error>> {
        let file = staged.as_file().try_clone()?;
        let mut writer = SerializedFileWriter::new(BufWriter::new(file), schema, properties)?;
        for (number, point) in result.points.iter().enumerate() {
            let levels: Vec<&Level> = point.levels.values().collect();
            let truth: Vec<f64> =
                point.estimators.iter().take(TRACKED.len()).map(|estimator| estimator.truth).collect();
            let mut first = 0;
            while first < point.trials {
                let trials = TRIALS_PER_GROUP.min(point.trials - first);
                let group = Group { plan, point: number as i64 + 1, levels: &levels, truth: &truth, first, trials };
                let mut bytes = vec![0; plan.estimates() * RECORD * usize::try_from(trials)?];
                input.read_exact(&mut bytes)?;
                let mut row_group = writer.next_row_group()?;
                group.write(&bytes, &mut row_group)?;
                row_group.close()?;
                first += trials;
            }
        }
        writer.close()?;
        Ok(())
    };
    write().map_err(|error| failed(&path, &error))?;
    staged.persist(&path).map_err(|error| failed(&path, &error))?;
    Ok(())
}

/// point, levels…, trial, method, parameter, truth, estimate, sigma.
fn schema(result: &SweepResult) -> Result<Type, ParquetError> {
    use parquet::basic::{LogicalType, Repetition, Type as Physical};
    let column = |name: &str, physical, repetition| {
        let logical = matches!(physical, Physical::BYTE_ARRAY).then_some(LogicalType::String);
        let column = Type::primitive_type_builder(name, physical).with_repetition(repetition);
        column.with_logical_type(logical).build().map(Arc::new)
    };
    let required = |name: &str, physical| column(name, physical, Repetition::REQUIRED);
    let mut columns = vec![required("point", Physical::INT64)?];
    for (axis, level) in result.points.first().into_iter().flat_map(|point| &point.levels) {
        let physical = match level {
            Level::Number(_) => Physical::DOUBLE,
            Level::Name(_) => Physical::BYTE_ARRAY,
        };
        columns.push(required(axis, physical)?);
    }
    columns.push(required("trial", Physical::INT64)?);
    columns.push(required("method", Physical::BYTE_ARRAY)?);
    columns.push(required("parameter", Physical::BYTE_ARRAY)?);
    columns.push(required("truth", Physical::DOUBLE)?);
    columns.push(column("estimate", Physical::DOUBLE, Repetition::OPTIONAL)?);
    columns.push(column("sigma", Physical::DOUBLE, Repetition::OPTIONAL)?);
    Type::group_type_builder("trials").with_fields(columns).build()
}

/// Some trials of one point.
struct Group<'a> {
    plan: &'a SweepPlan,
    point: i64,
    levels: &'a [&'a Level],
    truth: &'a [f64],
    first: u64,
    trials: u64,
}

impl Group<'_> {
    fn write<W: Write + Send>(
        &self,
        bytes: &[u8],
        group: &mut SerializedRowGroupWriter<'_, W>,
    ) -> Result<(), ParquetError> {
        let rows = bytes.len() / RECORD;
        let estimates = self.plan.estimates();
        let names: Vec<(&str, &str, f64)> = self
            .plan
            .methods
            .iter()
            .flat_map(|method| {
                TRACKED.iter().zip(self.truth).map(|(parameter, truth)| (method.name(), parameter.key(), *truth))
            })
            .collect();
        let text = |text: &str| ByteArray::from(text.as_bytes().to_vec());
        let texts = |of: &dyn Fn(usize) -> ByteArray| (0..rows).map(of).collect::<Vec<_>>();
        integers(group, &vec![self.point; rows])?;
        for level in self.levels {
            match level {
                Level::Number(number) => doubles(group, &vec![*number; rows], None)?,
                Level::Name(name) => strings(group, &texts(&|_| text(name)))?,
            }
        }
        // Trials are at most 1e8.
        let trials: Vec<i64> = (self.first..self.first + self.trials)
            .flat_map(|trial| std::iter::repeat_n(trial as i64, estimates))
            .collect();
        integers(group, &trials)?;
        strings(group, &texts(&|row| text(names[row % estimates].0)))?;
        strings(group, &texts(&|row| text(names[row % estimates].1)))?;
        doubles(group, &(0..rows).map(|row| names[row % estimates].2).collect::<Vec<_>>(), None)?;
        for offset in [0, RECORD / 2] {
            let number = |record: &[u8]| {
                let mut number = [0; 8];
                number.copy_from_slice(&record[offset..offset + 8]);
                f64::from_le_bytes(number)
            };
            let all: Vec<f64> = bytes.chunks_exact(RECORD).map(number).collect();
            let defined: Vec<i16> = all.iter().map(|number| i16::from(!number.is_nan())).collect();
            let values: Vec<f64> = all.into_iter().filter(|number| !number.is_nan()).collect();
            doubles(group, &values, Some(&defined))?;
        }
        Ok(())
    }
}

/// Writes one column; `defined` says which rows of an optional column have a value.
macro_rules! column_writer {
    ($name:ident, $Type:ty, $Value:ty) => {
        fn $name<W: Write + Send>(
            group: &mut SerializedRowGroupWriter<'_, W>,
            values: &[$Value],
            defined: Option<&[i16]>,
        ) -> Result<(), ParquetError> {
            if let Some(mut column) = group.next_column()? {
                column.typed::<$Type>().write_batch(values, defined, None)?;
                column.close()?;
            }
            Ok(())
        }
    };
}

column_writer!(doubles, DoubleType, f64);
column_writer!(required_integers, Int64Type, i64);
column_writer!(required_strings, ByteArrayType, ByteArray);

fn integers<W: Write + Send>(group: &mut SerializedRowGroupWriter<'_, W>, values: &[i64]) -> Result<(), ParquetError> {
    required_integers(group, values, None)
}

fn strings<W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[ByteArray],
) -> Result<(), ParquetError> {
    required_strings(group, values, None)
}
