//! What a row of the table holds: a call's name, its function, and how its refusals are worded.

use std::future::Future;
use std::pin::Pin;

use crate::endpoint::Endpoint;
use crate::rpc::{Answer, Refusal, Request};

/// An answer under way.
pub(super) type Running<'a> = Pin<Box<dyn Future<Output = Answer> + Send + 'a>>;
/// Reads its arguments from the request and answers.
pub(super) type Run = for<'a> fn(&'a mut Endpoint, &'a Request) -> Running<'a>;

/// How well a call is served, and by what.
#[derive(Clone, Copy)]
pub(crate) enum Service {
    /// As CARLA does.
    Full(Run),
    /// With a difference.
    Partial(
        Run,
        #[cfg_attr(not(test), expect(dead_code, reason = "for the compatibility page"))]
        &'static str,
    ),
    /// As CARLA does, by the [lobby](crate::lobby) before it comes to a row.
    ByLobby,
    /// Whatever the arguments, and why.
    Refused(&'static str),
}

/// One call.
#[derive(Clone, Copy)]
pub(crate) struct Method {
    pub(crate) name: &'static str,
    pub(crate) service: Service,
    needs_world: bool,
    /// Whether refusals name the function, as CARLA's do for what an actor cannot do.
    names_function: bool,
    /// Takes the place of a refusal where that would end the client's process: its Traffic Manager
    /// makes such calls on a thread where nothing catches exceptions.
    instead: Option<fn(&Request, Refusal) -> Answer>,
}

pub(super) const fn full(name: &'static str, run: Run) -> Method {
    Method::new(name, Service::Full(run))
}

pub(super) const fn partly(name: &'static str, what: &'static str, run: Run) -> Method {
    Method::new(name, Service::Partial(run, what))
}

pub(super) const fn by_lobby(name: &'static str) -> Method {
    Method::new(name, Service::ByLobby).early()
}

pub(super) const fn refused(name: &'static str, why: &'static str) -> Method {
    Method { needs_world: false, ..Method::new(name, Service::Refused(why)) }
}

impl Method {
    const fn new(name: &'static str, service: Service) -> Self {
        Self { name, service, needs_world: true, names_function: false, instead: None }
    }

    /// Answered even when there is no world.
    pub(super) const fn early(self) -> Self {
        Self { needs_world: false, ..self }
    }

    pub(super) const fn naming_function(self) -> Self {
        Self { names_function: true, ..self }
    }

    pub(super) const fn or(self, instead: fn(&Request, Refusal) -> Answer) -> Self {
        Self { instead: Some(instead), ..self }
    }

    pub(super) async fn answer(&self, endpoint: &mut Endpoint, request: &Request) -> Answer {
        let answer = self.answer_or_refuse(endpoint, request).await;
        match (answer, self.instead) {
            (Err(refusal), Some(instead)) => instead(request, refusal),
            (answer, _) => answer,
        }
    }

    async fn answer_or_refuse(&self, endpoint: &mut Endpoint, request: &Request) -> Answer {
        let run = match self.service {
            Service::Full(run) | Service::Partial(run, _) => run,
            Service::ByLobby => {
                return Err(Refusal(format!("{} is no call about a world", self.name)));
            }
            Service::Refused(why) => {
                let refusal = Refusal(format!("{}: {why}", self.name));
                if request.asynchronous {
                    tracing::warn!(%refusal, "the client does not wait to hear this");
                }
                return Err(refusal);
            }
        };
        if self.needs_world {
            endpoint.ensure_episode().await?;
        }
        let answer = run(endpoint, request).await;
        answer.map_err(|why| if self.names_function { by_function(self.name, &why) } else { why })
    }
}

/// CARLA's words for a function that could not do something.
pub(super) fn by_function(name: &str, why: &Refusal) -> Refusal {
    Refusal(format!("Responding error from function {name}: {why}"))
}

/// A placeholder for the type of one argument.
macro_rules! of_argument {
    ($argument:ident) => {
        _
    };
}

/// The arguments of a call, with the types that the function has which they are passed to.
macro_rules! arguments {
    ($request:ident: $($argument:ident),*) => {
        let (_, $($argument,)*): (crate::rpc::Meta, $(of_argument!($argument),)*) =
            $request.args()?;
    };
}

/// A call that is answered with what a function gives.
macro_rules! value {
    ($module:ident::$function:ident($($argument:ident),*)) => {
        |endpoint, request| Box::pin(async move {
            arguments!(request: $($argument),*);
            crate::rpc::Payload::value(&$module::$function(endpoint, $($argument),*)?)
        })
    };
    ($module:ident::$function:ident($($argument:ident),*).await) => {
        |endpoint, request| Box::pin(async move {
            arguments!(request: $($argument),*);
            crate::rpc::Payload::value(&$module::$function(endpoint, $($argument),*).await?)
        })
    };
}

/// A call that is answered with what a function gives for all arguments together, of which clients
/// of 0.10 leave out the last.
macro_rules! value_of_all {
    ($module:ident::$function:ident) => {
        |endpoint, request| {
            Box::pin(async move {
                crate::rpc::Payload::value(&$module::$function(endpoint, request.args()?).await?)
            })
        }
    };
}

/// A call whose answer says only that it was done.
macro_rules! void {
    ($module:ident::$function:ident($($argument:ident),*)) => {
        |endpoint, request| Box::pin(async move {
            arguments!(request: $($argument),*);
            let () = $module::$function(endpoint, $($argument),*)?;
            Ok(crate::rpc::Payload::Void)
        })
    };
    ($module:ident::$function:ident($($argument:ident),*).await) => {
        |endpoint, request| Box::pin(async move {
            arguments!(request: $($argument),*);
            let () = $module::$function(endpoint, $($argument),*).await?;
            Ok(crate::rpc::Payload::Void)
        })
    };
}

/// A call that does what a command of a batch does, with the next tick.
macro_rules! command {
    ($command:ident($($argument:ident),*)) => {
        |endpoint, request| Box::pin(async move {
            arguments!(request: $($argument),*);
            let command = crate::dialect::BatchCommand::$command($($argument),*);
            crate::calls::orders::queue(endpoint, &command).await?;
            Ok(crate::rpc::Payload::Void)
        })
    };
}

/// A call whose arguments are read and have no effect; nobody waits for its answer.
macro_rules! no_effect {
    ($($argument:ty),*) => {
        |_, request| Box::pin(async move {
            let _: (crate::rpc::Meta, $($argument,)*) = request.args()?;
            tracing::warn!(method = request.method, "this call has no effect");
            Ok(crate::rpc::Payload::Void)
        })
    };
}

pub(super) use {arguments, command, no_effect, of_argument, value, value_of_all, void};
