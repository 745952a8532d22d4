//! What can be wrong with what is asked.

/// Why something could not be done.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShError {
    /// An order outside [`crate::ORDERS`].
    #[error(
        "order {order} is out of range: spherical harmonics are computed for orders 1 to 8 (order n = n² coefficients)"
    )]
    Order {
        /// What was asked for.
        order: usize,
    },
    /// An image without texels.
    #[error("an image of {width} × {height} texels has nothing to project")]
    Empty {
        /// Texels in a row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A slice whose length is not what the sizes say.
    #[error("{what}: expected {expected} values, found {found}")]
    Length {
        /// What was counted.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A value that is not a finite number.
    #[error("texel ({x}, {y}) of {what} is {value}; only finite radiance can be projected")]
    NonFinite {
        /// The image, or its face.
        what: &'static str,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// The value.
        value: f32,
    },
    /// A number of coefficients that is not the square of an order.
    #[error("{found} coefficients are no order: 1, 4, 9, 16, 25, 36, 49 or 64 were expected")]
    Coefficients {
        /// How many there are.
        found: usize,
    },
}
