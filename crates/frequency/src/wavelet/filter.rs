//! The two filter pairs, scaled so that low-pass values are means and squared details are power per texel.

/// Which wavelets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Two taps: the best place, the worst separation of octaves, and blind to edges that lie on its grid.
    Haar,
    /// Daubechies' four taps: two vanishing moments, so that gradients are not detail. The default.
    #[default]
    Smooth,
}

/// Horizontally, what lies beyond the border; vertically, and for [`Border::Repeat`], the border's texels are repeated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// The picture ends: its border texels go on.
    Repeat,
    /// The left column follows the right one: latitude–longitude maps.
    WrapHorizontally,
    /// The picture tiles the plane: textures.
    Wrap,
}

/// Low-pass and high-pass taps at texels 2j − 1 … 2j + 2 of output j. Orthonormal taps divided by √2: low-pass values are
/// means, and the square of a detail is the power per texel of its wavelet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taps {
    pub(super) low: [f32; 4],
    pub(super) high: [f32; 4],
}

impl Filter {
    pub(super) fn taps(self) -> Taps {
        match self {
            Self::Haar => Taps { low: [0.0, 0.5, 0.5, 0.0], high: [0.0, 0.5, -0.5, 0.0] },
            Self::Smooth => {
                // (1 ± √3)/8 and (3 ± √3)/8.
                let low = [0.341_506_36, 0.591_506_36, 0.158_493_64, -0.091_506_35];
                Taps { low, high: [low[3], -low[2], low[1], -low[0]] }
            }
        }
    }
}
