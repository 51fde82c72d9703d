//! Requests in, replies out.

use std::borrow::Cow;

use rmp::decode;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use tokio::sync::OwnedSemaphorePermit;

use super::finite::skim;

/// Characters of a method's name.
const METHOD_CHARS_MAX: usize = 64;

/// One call of a client.
#[derive(Debug)]
pub(crate) struct Request {
    /// Which reply it waits for.
    pub(crate) id: u32,
    /// What is called.
    pub(crate) method: String,
    /// Whether the client throws the reply away.
    pub(crate) asynchronous: bool,
    params: Vec<u8>,
    /// Room that it takes up among all requests that wait.
    room: Option<OwnedSemaphorePermit>,
    /// Where its arguments come from in tests.
    #[cfg(test)]
    draw: Option<super::Draw>,
}

/// One connection in the life of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct ConnectionId(pub(crate) u64);

/// Whom a call is answered, once.
#[derive(Debug)]
pub(crate) struct Ticket {
    /// Who called.
    pub(crate) client: ConnectionId,
    /// Which reply it waits for.
    pub(crate) id: u32,
    /// Whether it has been told already that the call came.
    pub(crate) asynchronous: bool,
    has_envelope: bool,
}

/// First parameter of every call: whether it is asynchronous.
#[derive(Debug, Deserialize)]
pub(crate) struct Meta {
    #[expect(dead_code, reason = "read before the arguments")]
    asynchronous: bool,
}

/// What a call is answered with.
#[derive(Debug)]
pub(crate) enum Payload {
    /// Nothing, successfully.
    Void,
    /// An encoded value.
    Value(Vec<u8>),
    /// An encoded value without the envelope: `apply_batch` alone.
    Bare(Vec<u8>),
}

/// Why a call fails, as the script's exception says it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(crate) struct Refusal(pub(crate) String);

/// The outcome of a call.
pub(crate) type Answer = Result<Payload, Refusal>;

impl Payload {
    /// A value in its envelope.
    ///
    /// # Errors
    /// Values that MessagePack cannot hold; none of ours.
    pub(crate) fn value<T: Serialize + ?Sized>(value: &T) -> Answer {
        rmp_serde::to_vec(value).map(Self::Value).map_err(unencodable)
    }

    /// A value without an envelope.
    ///
    /// # Errors
    /// As for [`value`](Self::value).
    pub(crate) fn bare<T: Serialize + ?Sized>(value: &T) -> Answer {
        rmp_serde::to_vec(value).map(Self::Bare).map_err(unencodable)
    }
}

fn unencodable(cause: rmp_serde::encode::Error) -> Refusal {
    Refusal(format!("the answer cannot be encoded: {cause}"))
}

impl Request {
    /// Reads `[0, id, method, params]`.
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes;
        if decode::read_array_len(&mut rest).ok()? != 4 {
            return None;
        }
        if decode::read_int::<u8, _>(&mut rest).ok()? != 0 {
            return None;
        }
        let id = decode::read_int(&mut rest).ok()?;
        let length = decode::read_str_len(&mut rest).ok()? as usize;
        if length > METHOD_CHARS_MAX {
            return None;
        }
        let method = std::str::from_utf8(rest.get(..length)?).ok()?.to_owned();
        let params = rest.get(length..)?.to_vec();
        let asynchronous = asynchronous(&params)?;
        Some(Self {
            id,
            method,
            asynchronous,
            params,
            room: None,
            #[cfg(test)]
            draw: None,
        })
    }

    /// A call whose arguments are drawn when it is known of which types they are.
    #[cfg(test)]
    pub(crate) fn drawn(method: &str, draw: super::Draw) -> Self {
        let (method, params) = (method.to_owned(), Vec::new());
        Self { id: 1, method, asynchronous: false, params, room: None, draw: Some(draw) }
    }

    /// The parameters; in tests drawn for the types that they are read as.
    #[cfg_attr(
        not(test),
        expect(clippy::extra_unused_type_parameters, reason = "what is sent has its types")
    )]
    fn params<T: DeserializeOwned>(&self) -> Cow<'_, [u8]> {
        #[cfg(test)]
        if let Some(draw) = &self.draw {
            return Cow::Owned(draw.bytes_of::<T>());
        }
        Cow::Borrowed(&self.params)
    }

    /// Takes up room until it is done.
    pub(super) fn take_room(&mut self, room: OwnedSemaphorePermit) {
        self.room = Some(room);
    }

    /// Where the answer goes.
    pub(crate) fn ticket(&self, client: ConnectionId) -> Ticket {
        let has_envelope = self.method != "apply_batch";
        Ticket { client, id: self.id, asynchronous: self.asynchronous, has_envelope }
    }

    /// The arguments as a tuple that begins with [`Meta`].
    ///
    /// # Errors
    /// Says what does not fit; a number that is not finite never does.
    pub(crate) fn args<T: DeserializeOwned>(&self) -> Result<T, Refusal> {
        let params = self.params::<T>();
        let args = rmp_serde::from_slice(&params).map_err(|cause| self.garbled(&cause))?;
        if skim(&params).is_some_and(|params| params.is_finite) {
            return Ok(args);
        }
        Err(Refusal(format!("the arguments of {} are not all finite numbers", self.method)))
    }

    /// The commands of a batch, and whether a tick is to follow. A command with a number that is
    /// not finite is refused by itself.
    ///
    /// # Errors
    /// Says what does not fit.
    pub(crate) fn batch<T: DeserializeOwned>(
        &self,
    ) -> Result<(Vec<Result<T, Refusal>>, bool), Refusal> {
        let params = self.params::<(Meta, Vec<T>, bool)>();
        let (_, commands, tick): (Meta, Vec<T>, bool) =
            rmp_serde::from_slice(&params).map_err(|cause| self.garbled(&cause))?;
        let are_finite = are_commands_finite(&params, commands.len()).unwrap_or_default();
        let mut are_finite = are_finite.into_iter();
        let checked = commands.into_iter().map(|command| match are_finite.next() {
            Some(true) => Ok(command),
            _ => Err(Refusal("the command's numbers are not all finite".to_owned())),
        });
        Ok((checked.collect(), tick))
    }

    fn garbled(&self, cause: &rmp_serde::decode::Error) -> Refusal {
        Refusal(format!("the arguments of {} cannot be understood: {cause}", self.method))
    }
}

/// For each of the commands in the parameters of a batch.
fn are_commands_finite(params: &[u8], count: usize) -> Option<Vec<bool>> {
    let mut rest = params;
    decode::read_array_len(&mut rest).ok()?;
    rest = rest.get(skim(rest)?.bytes..)?;
    decode::read_array_len(&mut rest).ok()?;
    let mut are_finite = Vec::with_capacity(count);
    for _ in 0..count {
        let command = skim(rest)?;
        are_finite.push(command.is_finite);
        rest = rest.get(command.bytes..)?;
    }
    Some(are_finite)
}

/// The metadata, `[bool]`, at the front of the parameters.
fn asynchronous(params: &[u8]) -> Option<bool> {
    let mut rest = params;
    if decode::read_array_len(&mut rest).ok()? == 0 || decode::read_array_len(&mut rest).ok()? == 0
    {
        return None;
    }
    decode::read_bool(&mut rest).ok()
}

/// `[1, id, nil, result]`, or for a refusal of a call without an envelope `[1, id, text, nil]`.
pub(super) fn encode_reply(id: u32, answer: &Answer, has_envelope: bool) -> Vec<u8> {
    let mut out = vec![0x94, 0x01, 0xce];
    out.extend_from_slice(&id.to_be_bytes());
    match answer {
        Ok(Payload::Void) => out.extend_from_slice(&[0xc0, 0x91, 0x91, 0xc2]),
        Ok(Payload::Value(value)) => {
            out.extend_from_slice(&[0xc0, 0x91, 0x92, 0x01]);
            out.extend_from_slice(value);
        }
        Ok(Payload::Bare(value)) => {
            out.push(0xc0);
            out.extend_from_slice(value);
        }
        Err(refusal) if has_envelope => {
            out.extend_from_slice(&[0xc0, 0x91, 0x92, 0x00, 0x91]);
            push_text(&mut out, &refusal.0);
        }
        Err(refusal) => {
            push_text(&mut out, &refusal.0);
            out.push(0xc0);
        }
    }
    out
}

impl Ticket {
    /// The bytes of the reply.
    pub(super) fn reply(&self, answer: &Answer) -> Vec<u8> {
        encode_reply(self.id, answer, self.has_envelope)
    }

    #[cfg(test)]
    pub(crate) fn for_test(client: ConnectionId, id: u32) -> Self {
        Self { client, id, asynchronous: false, has_envelope: true }
    }
}

fn push_text(out: &mut Vec<u8>, text: &str) {
    let cut = text.char_indices().map(|(at, c)| at + c.len_utf8()).take_while(|end| *end < 2_048);
    let cut = &text[..cut.last().unwrap_or(0)];
    out.push(0xda);
    out.extend_from_slice(&(cut.len() as u16).to_be_bytes());
    out.extend_from_slice(cut.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    const VERSION: &[u8] =
        &[0x94, 0x00, 0x01, 0xa7, 0x76, 0x65, 0x72, 0x73, 0x69, 0x6f, 0x6e, 0x91, 0x91, 0xc2];

    #[test]
    fn the_first_request_of_every_client_is_understood() {
        let request = Request::parse(VERSION).unwrap();
        assert_eq!(
            (request.id, request.method.as_str(), request.asynchronous),
            (1, "version", false)
        );
        request.args::<(Meta,)>().unwrap();
    }

    #[test]
    fn replies_have_the_measured_bytes() {
        let void = [0x94, 1, 0xce, 0, 0, 0, 7, 0xc0, 0x91, 0x91, 0xc2];
        assert_eq!(encode_reply(7, &Ok(Payload::Void), true), void);
        let value = encode_reply(7, &Payload::value("0.9.16"), true);
        assert_eq!(&value[7..], b"\xc0\x91\x92\x01\xa60.9.16");
        let error = encode_reply(7, &Err(Refusal("no".to_owned())), true);
        assert_eq!(&error[7..], b"\xc0\x91\x92\x00\x91\xda\x00\x02no");
        let bare = encode_reply(7, &Err(Refusal("no".to_owned())), false);
        assert_eq!(&bare[7..], b"\xda\x00\x02no\xc0");
    }

    #[test]
    fn what_is_no_request_is_not_taken_for_one() {
        for bytes in [
            &b"\x93\x00\x01\xa1a"[..],
            b"\x94\x01\x01\xa1a\x91\x91\xc2",
            b"\x94\x00\x01\xa1a\x90",
            b"\xc0",
        ] {
            assert!(Request::parse(bytes).is_none(), "{bytes:?}");
        }
    }
}
