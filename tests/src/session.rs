//! One WebSocket client, as an OpenEnv client behaves.

use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::{self, Message, WebSocket};

use crate::{AT_LAST, SOON, eventually};

/// One WebSocket connection; the session ends with it.
pub struct Session {
    socket: WebSocket<TcpStream>,
}

impl Session {
    /// Connects; waits for a server that is still starting.
    pub fn open(address: SocketAddr) -> Self {
        eventually("WebSocket", SOON, || Self::try_open(address))
    }

    fn try_open(address: SocketAddr) -> Result<Self, String> {
        let stream = TcpStream::connect(address).map_err(|error| error.to_string())?;
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(AT_LAST)).unwrap();
        let url = format!("ws://{address}/ws");
        let (socket, _) = tungstenite::client(url, stream).map_err(|error| error.to_string())?;
        Ok(Self { socket })
    }

    /// Gives up on answers after this time.
    pub fn set_deadline(&mut self, deadline: Duration) {
        self.socket.get_mut().set_read_timeout(Some(deadline)).unwrap();
    }

    /// Starts an episode; the observation's `data`.
    pub fn reset(&mut self, arguments: Value) -> Value {
        observation(self.ask(&json!({"type": "reset", "data": arguments})))
    }

    /// Takes a step; the observation's `data`.
    pub fn step(&mut self, action: Value) -> Value {
        observation(self.ask(&json!({"type": "step", "data": action})))
    }

    /// The state's `data`.
    pub fn state(&mut self) -> Value {
        let answer = self.ask(&json!({"type": "state"}));
        assert_eq!(answer["type"], "state", "{answer}");
        answer["data"].clone()
    }

    /// The answer to a message.
    pub fn ask(&mut self, message: &Value) -> Value {
        self.ask_text(&message.to_string())
    }

    /// The answer to a text that may be no message at all.
    pub fn ask_text(&mut self, text: &str) -> Value {
        self.send(Message::text(text));
        self.read()
    }

    /// The answer to a binary frame.
    pub fn ask_bytes(&mut self, bytes: Vec<u8>) -> Value {
        self.send(Message::binary(bytes));
        self.read()
    }

    /// The next answer.
    pub fn read(&mut self) -> Value {
        self.try_read().unwrap_or_else(|end| panic!("the server ended the session: {end}"))
    }

    /// The next answer, or how the connection ended.
    pub fn try_read(&mut self) -> Result<Value, String> {
        loop {
            match self.socket.read().map_err(|error| error.to_string())? {
                Message::Text(text) => {
                    return serde_json::from_str(&text).map_err(|e| e.to_string());
                }
                Message::Close(frame) => return Err(format!("closed: {frame:?}")),
                Message::Ping(_) | Message::Pong(_) => {}
                other => return Err(format!("no text: {other:?}")),
            }
        }
    }

    /// Sends a frame; a connection that the server has ended already shows in the next read.
    pub fn send(&mut self, message: Message) {
        let _ = self.socket.send(message);
    }
}

fn observation(answer: Value) -> Value {
    assert_eq!(answer["type"], "observation", "{answer}");
    answer["data"].clone()
}
