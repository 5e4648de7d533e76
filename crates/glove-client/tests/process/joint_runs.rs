//! Runs of a hand whose joints another program sends: what the terminal tells of it, and when.

use std::io::{BufRead, BufReader};
use std::net::UdpSocket;
use std::process::{Child, ChildStderr, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use softgrasp_grasp::hand::{HandDimensions, JointAngles};
use softgrasp_hand::joints::record_of_hand;

use crate::start::{command, free_address};

/// Run that listens for joints, and the lines that it prints.
struct JointRun {
    run: Child,
    sender: UdpSocket,
    address: String,
    said: Receiver<String>,
    heard: Vec<String>,
}

/// Time after which a run is taken to hang.
const HANG: Duration = Duration::from_secs(120);

impl JointRun {
    fn start() -> Self {
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = free_address();
        let hand = format!("joints:{address}");
        let mut run = command()
            .args(["run", "--headless", "--object", "cube", "--nodes", "64", "--hand", &hand])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = lines(run.stderr.take().unwrap());
        Self { run, sender, address, said, heard: Vec::new() }
    }

    /// Sends records of a hand that opens and closes, changed by `spoilt`, until a sentence contains
    /// `words`, while the run goes on.
    fn until_said(&mut self, words: &str, spoilt: impl Fn(String) -> Option<String>) {
        let begun = Instant::now();
        for i in 0.. {
            assert!(begun.elapsed() < HANG, "never said: {words}; said: {:?}", self.heard);
            let closed = 0.5 - 0.5 * (0.2 * f64::from(i)).cos();
            let angles = JointAngles::flat().lerp(&JointAngles::fist(), closed);
            let palm = Isometry3::translation(0.1, 0.2, 0.0);
            let line = record_of_hand(&HandDimensions::default(), &angles, &palm).to_line();
            if let Some(sent) = spoilt(line) {
                // Before the run listens nobody takes them.
                let _ = self.sender.send_to(sent.as_bytes(), &self.address);
            }
            match self.said.recv_timeout(Duration::from_millis(10)) {
                Ok(line) => self.heard.push(line),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => panic!("it ended: {:?}", self.heard),
            }
            if self.heard.iter().any(|line| line.contains(words)) {
                return;
            }
        }
    }

    /// Ends the run; its exit code and all lines that it printed.
    fn end(mut self) -> (Option<i32>, Vec<String>) {
        let kill = format!("kill -INT {}", self.run.id());
        assert!(std::process::Command::new("sh").args(["-c", &kill]).status().unwrap().success());
        let code = self.run.wait().unwrap().code();
        self.heard.extend(self.said.iter());
        (code, self.heard)
    }
}

fn lines(from: ChildStderr) -> Receiver<String> {
    let (line, lines) = channel();
    std::thread::spawn(move || {
        BufReader::new(from).lines().map_while(Result::ok).for_each(|text| drop(line.send(text)));
    });
    lines
}

/// Number of lines that begin with these words.
fn count(said: &[String], words: &str) -> usize {
    said.iter().filter(|line| line.starts_with(&format!("glove-client: {words}"))).count()
}

#[test]
fn who_sends_joints_is_said_on_the_terminal_while_the_run_goes_on_and_once() {
    let mut run = JointRun::start();
    run.until_said("joints of a right hand, metres", Some);
    let (code, said) = run.end();
    assert_eq!(code, Some(0), "{said:?}");
    assert_eq!(count(&said, "joints of a right hand, metres"), 1, "{said:?}");
}

#[test]
fn joints_in_centimetres_are_said_on_the_terminal_at_once_and_a_run_without_a_pose_ends_with_1() {
    let mut run = JointRun::start();
    run.until_said("they seem to be in centimetres", |line| {
        let mut record: serde_json::Value = serde_json::from_str(&line).unwrap();
        for joint in record["joints"].as_array_mut().unwrap() {
            let places = joint.as_array_mut().map(|place| place.iter_mut());
            places.into_iter().flatten().for_each(|x| *x = (100.0 * x.as_f64().unwrap()).into());
        }
        Some(format!("{record}\n"))
    });
    let (code, said) = run.end();
    assert_eq!(code, Some(1), "{said:?}");
    assert_eq!(count(&said, "the joints are those of a hand"), 1, "{said:?}");
    let last = said.last().unwrap();
    assert!(last.contains("there was never a hand") && last.contains("centimetres"), "{said:?}");
}

#[test]
fn run_of_joints_that_nobody_sends_ends_with_1_and_the_reason() {
    let mut run = JointRun::start();
    run.until_said("nobody sends joints to", |_| None);
    let (code, said) = run.end();
    assert_eq!(code, Some(1), "{said:?}");
    assert!(said.last().unwrap().contains("there was never a hand: nobody sends"), "{said:?}");
}
