//! scenario-service
