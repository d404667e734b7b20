//! Grids that encoders and planners share.

mod layout;
mod marks;

pub(crate) use layout::Layout;
pub(crate) use marks::Marks;
