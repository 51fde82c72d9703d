//! world-service
