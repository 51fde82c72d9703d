//! render-service
