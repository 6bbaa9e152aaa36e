//! Derivatives of poses by the columns of the normal equation, laid out for vector instructions.

use kinematics::Rotation;
use nalgebra::{Matrix3, Vector3};

/// Derivatives of a pose or a motion by columns, coordinate by coordinate, so that loops over columns
/// vectorise.
pub(super) struct Derivatives {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) theta: Vec<f64>,
}

impl Derivatives {
    pub(super) fn zeros(columns: usize) -> Self {
        Self { x: vec![0.0; columns], y: vec![0.0; columns], theta: vec![0.0; columns] }
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.x.fill(0.0);
        self.y.fill(0.0);
        self.theta.fill(0.0);
    }

    #[inline(always)]
    pub(super) fn set(&mut self, column: usize, of: Vector3<f64>) {
        (self.x[column], self.y[column], self.theta[column]) = (of.x, of.y, of.z);
    }

    #[inline(always)]
    pub(super) fn get(&self, column: usize) -> Vector3<f64> {
        Vector3::new(self.x[column], self.y[column], self.theta[column])
    }

    /// Carries them over a step of the pose: a heading that is off turns what comes after.
    #[inline(always)]
    pub(super) fn turn(&mut self, step: Vector3<f64>) {
        for ((x, y), theta) in self.x.iter_mut().zip(&mut self.y).zip(&self.theta) {
            *x -= step.y * theta;
            *y += step.x * theta;
        }
    }

    /// Adds others, turned by an angle, from a column on.
    #[inline(always)]
    pub(super) fn add_turned(&mut self, from: usize, Rotation { sin, cos }: Rotation, others: &Self) {
        let own = self.x[from..].iter_mut().zip(&mut self.y[from..]).zip(&mut self.theta[from..]);
        for (((x, y), theta), ((of_x, of_y), of_theta)) in own.zip(others.x.iter().zip(&others.y).zip(&others.theta)) {
            *x += cos * of_x - sin * of_y;
            *y += sin * of_x + cos * of_y;
            *theta += of_theta;
        }
    }

    /// The component of each along a direction.
    #[inline(always)]
    pub(super) fn along(&self, direction: Vector3<f64>) -> impl Iterator<Item = f64> {
        let all = self.x.iter().zip(&self.y).zip(&self.theta);
        all.map(move |((x, y), theta)| direction.x * x + direction.y * y + direction.z * theta)
    }

    #[inline(always)]
    pub(super) fn copy_from(&mut self, others: &Self) {
        self.x.copy_from_slice(&others.x);
        self.y.copy_from_slice(&others.y);
        self.theta.copy_from_slice(&others.theta);
    }

    /// Others, and a matrix times what these are more than the others.
    #[inline(always)]
    pub(super) fn mix(&mut self, others: &Self, gain: &Matrix3<f64>) {
        let own = self.x.iter_mut().zip(&mut self.y).zip(&mut self.theta);
        for (((x, y), theta), ((of_x, of_y), of_theta)) in own.zip(others.x.iter().zip(&others.y).zip(&others.theta)) {
            let more = gain * Vector3::new(*x - of_x, *y - of_y, *theta - of_theta);
            (*x, *y, *theta) = (of_x + more.x, of_y + more.y, of_theta + more.z);
        }
    }

    /// Adds a vector times a number of each column.
    #[inline(always)]
    pub(super) fn add(&mut self, vector: Vector3<f64>, times: &[f64]) {
        let own = self.x.iter_mut().zip(&mut self.y).zip(&mut self.theta);
        for (((x, y), theta), times) in own.zip(times) {
            *x += vector.x * times;
            *y += vector.y * times;
            *theta += vector.z * times;
        }
    }
}
