//! Who may use a site, and how much of it: tokens, the tenants they belong to, and quotas.
//!
//! A [`Door`] decides from what a client presents. It follows a file of tenants ([`People`]) that
//! may change while services run, or lets everybody in as one tenant where nobody wants tokens.

mod door;
mod failures;
mod people;
mod pixels;
mod secret;
mod seldom;

pub use door::{Door, DoorError, FOLLOW_EVERY, Refusal};
pub use people::{Invalid, People, Quotas, Visitor};
pub use pixels::PixelBudget;
pub use secret::{Secret, TokenId, expiry};
pub use seldom::Seldom;
