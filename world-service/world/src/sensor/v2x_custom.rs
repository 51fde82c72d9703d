//! Texts by radio: `sensor.other.v2x_custom`.

use schemas::limits::{V2X_TEXT_BYTES_MAX, V2X_TEXTS_PER_TICK_MAX};
use schemas::{ActorId, CustomMessage, Error, ErrorCode, Measurement};
use serde::{Deserialize, Serialize};

use super::config::Settings;
use super::mount::{Mount, Surroundings};
use super::noise::Noise;
use super::radio::{Antenna, Content, Radio, Transmission};

/// CARLA's attributes, and what is to be sent in the next tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct V2xCustom {
    radio: Radio,
    /// Only sensors of the same one hear each other.
    channel: String,
    texts: Vec<String>,
}

impl V2xCustom {
    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        Ok(Self {
            radio: Radio::new(settings)?,
            channel: settings.text("channel_id").to_owned(),
            texts: Vec::new(),
        })
    }

    /// Whether it differs from `fresh` by what it still has to send only.
    pub(super) fn is_used(&self, fresh: &Self) -> bool {
        let texts_fit = self.texts.len() <= V2X_TEXTS_PER_TICK_MAX
            && self.texts.iter().all(|text| text.len() <= V2X_TEXT_BYTES_MAX);
        texts_fit && self.radio == fresh.radio && self.channel == fresh.channel
    }

    /// # Errors
    /// `TooLarge` for a text that is too long, `Capacity` for too many in one tick.
    pub(super) fn queue(&mut self, text: &str) -> Result<(), Error> {
        if text.len() > V2X_TEXT_BYTES_MAX {
            return Err(Error::new(ErrorCode::TooLarge, "the text is too long")
                .wanted(format_args!("at most {V2X_TEXT_BYTES_MAX} bytes"))
                .found(format_args!("{} bytes", text.len())));
        }
        if self.texts.len() >= V2X_TEXTS_PER_TICK_MAX {
            return Err(Error::new(ErrorCode::Capacity, "the sensor has too many texts to send")
                .wanted(format_args!("at most {V2X_TEXTS_PER_TICK_MAX} in a tick")));
        }
        self.texts.push(text.to_owned());
        Ok(())
    }

    pub(super) fn transmit(
        &mut self,
        sensor: ActorId,
        mount: &Mount,
        around: &Surroundings,
    ) -> Option<Transmission> {
        let texts = std::mem::take(&mut self.texts);
        if texts.is_empty() {
            return None;
        }
        let station = mount.host.unwrap_or(sensor);
        let messages: Vec<CustomMessage> =
            texts.into_iter().map(|text| CustomMessage { station, text }).collect();
        let content = Content::Texts { channel: self.channel.clone(), messages };
        let antenna = Antenna::on_sensor(mount, around);
        Some(self.radio.transmission(sensor, antenna, content))
    }

    /// `None` when nothing arrives.
    pub(super) fn measure(
        &self,
        sensor: ActorId,
        mount: &Mount,
        around: &Surroundings,
        noise: &mut Noise,
    ) -> Option<Measurement> {
        let antenna = Antenna::on_sensor(mount, around);
        let received = self.radio.receive(&antenna, around, noise, |sent| match &sent.content {
            Content::Texts { channel, messages }
                if sent.sensor != sensor && *channel == self.channel =>
            {
                messages.clone()
            }
            _ => Vec::new(),
        });
        (!received.is_empty()).then_some(Measurement::V2xCustom(received))
    }
}
