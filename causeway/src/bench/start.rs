//! How long after `causeway up` is the first reset answered?
//!
//! Every round starts a site of its own on free ports, as a person would, and asks for a reset over
//! HTTP as soon as something listens. Printed are medians over the rounds.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

/// A site that has not answered by then never will.
const DEADLINE: Duration = Duration::from_secs(20);
/// Between two looks at a port that is still closed.
const POLL: Duration = Duration::from_micros(200);

#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// Sites to start, one after the other.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    rounds: u32,
}

/// Why there is no number.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StartError {
    /// No process, pipe or connection.
    #[error("the site could not be measured: {0}")]
    System(#[from] std::io::Error),
    /// It ended or stayed silent.
    #[error("the site did not {0} within {deadline} s", deadline = DEADLINE.as_secs())]
    Silent(&'static str),
    /// It answered something else.
    #[error("the first reset was refused: {0}")]
    Refused(String),
}

/// Moments of one start, counted from the start of the process.
struct Round {
    /// The addresses are printed and the services started.
    announced: Duration,
    /// The OpenEnv face takes connections.
    listening: Duration,
    /// The first reset is answered.
    reset: Duration,
    /// How long the second reset took, on a warm site.
    warm: Duration,
}

pub(crate) fn run(args: &Args) -> Result<(), StartError> {
    let mut rounds = Vec::new();
    for _ in 0..args.rounds {
        rounds.push(one_round()?);
    }
    let millis = |of: fn(&Round) -> Duration| median(&rounds, of).as_secs_f64() * 1e3;
    let (announced, listening) = (millis(|round| round.announced), millis(|round| round.listening));
    let (reset, warm) = (millis(|round| round.reset), millis(|round| round.warm));
    println!("first answered reset after `causeway up`, median of {} starts", args.rounds);
    println!("  {announced:7.1} ms  checking ports, starting the services");
    println!("  {:7.1} ms  the scenario service listens", listening - announced);
    println!("  {:7.1} ms  bus, map and first world", reset - listening - warm);
    println!("  {warm:7.1} ms  a reset on a warm site");
    println!("  {reset:7.1} ms  in all");
    Ok(())
}

fn median(rounds: &[Round], of: fn(&Round) -> Duration) -> Duration {
    let mut times: Vec<Duration> = rounds.iter().map(of).collect();
    times.sort_unstable();
    times.get(times.len() / 2).copied().unwrap_or_default()
}

fn one_round() -> Result<Round, StartError> {
    let begun = Instant::now();
    let mut site = Site::start()?;
    let http = site.http_address()?;
    let announced = begun.elapsed();
    let stream = connect(http, begun)?;
    let listening = begun.elapsed();
    reset(stream)?;
    let reset_at = begun.elapsed();
    reset(TcpStream::connect(http)?)?;
    let warm = begun.elapsed() - reset_at;
    Ok(Round { announced, listening, reset: reset_at, warm })
}

/// `causeway up`, ended when dropped.
struct Site {
    process: Child,
    /// Kept open to the end: it goes on printing.
    output: BufReader<ChildStdout>,
}

impl Site {
    fn start() -> Result<Self, StartError> {
        let mut process = Command::new(std::env::current_exe()?)
            .args(["up", "--http", "127.0.0.1:0", "--bus", "tcp/127.0.0.1:0"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let output = process.stdout.take().ok_or(StartError::Silent("print"))?;
        Ok(Self { process, output: BufReader::new(output) })
    }

    /// From the line that `up` prints for people.
    fn http_address(&mut self) -> Result<SocketAddr, StartError> {
        for line in self.output.by_ref().lines() {
            let line = line?;
            let address = line.split_once("http://").and_then(|(_, rest)| {
                rest.split_whitespace().next()?.trim_end_matches('/').parse().ok()
            });
            if let Some(address) = address {
                return Ok(address);
            }
        }
        Err(StartError::Silent("print its address"))
    }
}

impl Drop for Site {
    fn drop(&mut self) {
        if let Some(pid) = i32::try_from(self.process.id()).ok().and_then(Pid::from_raw) {
            // Already gone is as good as ended.
            let _ = kill_process(pid, Signal::TERM);
        }
        let _ = self.process.wait();
    }
}

fn connect(http: SocketAddr, begun: Instant) -> Result<TcpStream, StartError> {
    while begun.elapsed() < DEADLINE {
        match TcpStream::connect(http) {
            Ok(stream) => return Ok(stream),
            Err(_) => std::thread::sleep(POLL),
        }
    }
    Err(StartError::Silent("listen"))
}

fn reset(mut stream: TcpStream) -> Result<(), StartError> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(DEADLINE))?;
    let body = r#"{"seed":7}"#;
    let request = format!(
        "POST /reset HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\
         content-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(request.as_bytes())?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    if answer.starts_with("HTTP/1.1 200") {
        return Ok(());
    }
    Err(StartError::Refused(answer.lines().next().unwrap_or("no answer").to_owned()))
}
