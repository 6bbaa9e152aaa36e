//! What the paper prints: tables 1 and 2. The raw data behind them are not available.
//!
//! Navarro, Benet, Ríos, Bueno, "Mejoras en la localización odométrica de un robot diferencial mediante la
//! corrección de errores sistemáticos".

use kinematics::Wheels;

use super::shape::SampleShape;

/// Table 1: odometric sensitivity, mm/pulse, over the runs that the paper kept.
pub const TABLE_1: Wheels<SampleShape> = Wheels {
    left: SampleShape {
        count: 79,
        mean: 1.0334,
        variance: 4.13e-6,
        std: 2.03e-3,
        min: 1.0293,
        max: 1.0384,
        range: 0.0091,
        skewness_z: 0.2420,
        kurtosis_z: -0.8991,
    },
    right: SampleShape {
        count: 82,
        mean: 1.0322,
        variance: 2.97e-6,
        std: 1.72e-3,
        min: 1.0281,
        max: 1.0359,
        range: 0.0078,
        skewness_z: -0.1426,
        kurtosis_z: -0.8436,
    },
};

/// A value of table 2 with the σ printed beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printed {
    /// The value.
    pub value: f64,
    /// The σ, where one is printed.
    pub sigma: Option<f64>,
    /// Half a unit of the last printed digit.
    pub half_digit: f64,
}

const fn printed(value: f64, sigma: Option<f64>, half_digit: f64) -> Printed {
    Printed { value, sigma, half_digit }
}

/// A column of table 2: C in mm/pulse, B in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// C_L and C_R.
    pub sensitivity: Wheels<Printed>,
    /// B.
    pub base: Printed,
}

/// Table 2, what the robot believed.
pub const TABLE_2_NOMINAL: Column = Column {
    sensitivity: Wheels { left: printed(1.0, None, 0.0), right: printed(1.0, None, 0.0) },
    base: printed(363.0, None, 0.0),
};

/// Table 2, the direct method.
pub const TABLE_2_DIRECT: Column = Column {
    sensitivity: Wheels { left: printed(1.033, Some(0.003), 0.0005), right: printed(1.032, Some(0.004), 0.0005) },
    base: printed(363.0, Some(1.0), 0.5),
};

/// Table 2, UMBmark.
pub const TABLE_2_UMBMARK: Column = Column {
    sensitivity: Wheels { left: printed(1.0010, None, 0.00005), right: printed(0.9990, None, 0.00005) },
    base: printed(360.0, None, 0.5),
};
