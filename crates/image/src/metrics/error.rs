/// Why two pictures could not be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetricError {
    /// The two differ in size.
    #[error(
        "cannot compare the pictures: one has {}×{} pixels and the reference {}×{} \
         (render or crop them to one size; pictures are not scaled here, since that would change their error)",
        image.0, image.1, reference.0, reference.1
    )]
    Sizes {
        /// Columns and rows of the picture under test.
        image: (usize, usize),
        /// Columns and rows of the reference.
        reference: (usize, usize),
    },
    /// There is no pixel.
    #[error("cannot compare the pictures: they have no pixels (the smallest picture is 1×1)")]
    Empty,
    /// There are pixels, but no one of them is finite in both pictures.
    #[error(
        "cannot compare the pictures: of {pixels} pixels none is finite in both ({image} of the picture and \
         {reference} of the reference hold a NaN or an infinity; look at how they were made)"
    )]
    NothingFinite {
        /// Pixels of each picture.
        pixels: usize,
        /// Pixels of the picture under test with a NaN or an infinity.
        image: usize,
        /// Pixels of the reference with a NaN or an infinity.
        reference: usize,
    },
}
