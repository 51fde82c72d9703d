//! Maps that a client brings along.

use schemas::{Reply, Request};

use super::Endpoint;
use crate::rpc::Refusal;

impl Endpoint {
    /// Makes an OpenDRIVE text loadable as [`UPLOADED_MAP`](super::loading::UPLOADED_MAP).
    ///
    /// # Errors
    /// What is wrong with the text.
    pub(crate) async fn upload(&mut self, text: String) -> Result<(), Refusal> {
        let request = Request::PutMap { name: self.upload_name(), text };
        match self.site.ask(request).await {
            Ok(Reply::Done) => Ok(()),
            Ok(_) => Err(Refusal("the world service answered something else".to_owned())),
            Err(error) => Err(Refusal(error.to_string())),
        }
    }
}
