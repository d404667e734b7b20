//! The choice of an instruction set, which engines and networks share.

use std::fmt;

use crate::error::Error;

/// The instruction set that computes observations and networks. The results are the same for all paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SimdPath {
    /// No intrinsics; available on every machine.
    Scalar,
    /// AVX2 and FMA.
    Avx2,
    /// AVX2, FMA, AVX-512 F and AVX-512 BW.
    Avx512,
}

impl SimdPath {
    /// All paths, from the narrowest vectors to the widest.
    pub const ALL: [Self; 3] = [Self::Scalar, Self::Avx2, Self::Avx512];

    /// The environment variable that forces a path.
    pub const VARIABLE: &'static str = "POGEMA_SIMD";

    /// Returns whether this machine supports the path.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// Returns all paths that this machine supports, the widest last.
    pub fn available() -> impl DoubleEndedIterator<Item = Self> {
        Self::ALL.into_iter().filter(|path| path.is_available())
    }

    /// Returns the widest path that this machine supports.
    pub fn best() -> Self {
        Self::available().next_back().unwrap_or(Self::Scalar)
    }

    /// Returns the path named by the variable `POGEMA_SIMD` [default: the widest path of this machine].
    ///
    /// # Errors
    /// [`Error::Argument`] if the variable is set, but not to the name of a path that this machine supports.
    pub fn from_environment() -> Result<Self, Error> {
        let Some(value) = std::env::var_os(Self::VARIABLE) else { return Ok(Self::best()) };
        let name = value.to_string_lossy();
        let path = Self::ALL.into_iter().find(|path| path.to_string() == name);
        let path =
            path.ok_or_else(|| Error::argument(Self::VARIABLE, &name, "`scalar`, `avx2` or `avx512`"))?;
        path.check_as(Self::VARIABLE).map(|()| path)
    }

    /// Checks that this machine supports the path.
    ///
    /// # Errors
    /// [`Error::Argument`] if it does not.
    pub fn check(self) -> Result<(), Error> {
        self.check_as("path")
    }

    fn check_as(self, name: &str) -> Result<(), Error> {
        if self.is_available() {
            return Ok(());
        }
        Err(Error::argument(name, self, format!("at most `{}` on this machine", Self::best())))
    }
}

impl fmt::Display for SimdPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        })
    }
}
