//! Thousands of faulty links, each by its seed, with a clock that never waits: the same bits as without
//! faults or a clean end, and no session or memory is left behind.

use std::time::Duration;

use fea_server::LocalServer;
use softgrasp_protocol::ConnectionError;
use softgrasp_tests::conversation::Conversation;
use softgrasp_tests::faulty_pipe::{WayFaults, faulty_pipe};
use softgrasp_tests::heard::Heard;
use softgrasp_tests::random::Random;
use softgrasp_tests::watchdog::within;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::task::JoinSet;

use crate::start::config;

const LIMIT: Duration = Duration::from_secs(300);
/// Number of seeds, unless `SEEDS` says another.
const SEEDS: u64 = 2000;
/// Approximate number of bytes of the conversation, in each direction.
const LEN: usize = 9000;

/// Value of a metric on the server's page.
fn number(server: &LocalServer, name: &str) -> f64 {
    let text = server.metrics();
    let found = text.lines().find_map(|line| line.strip_prefix(name)?.trim().parse().ok());
    found.unwrap_or_else(|| panic!("{name} is not told"))
}

async fn undisturbed(server: &LocalServer, conversation: &Conversation) -> Vec<Heard> {
    let (client, serves) = server.connect().unwrap();
    let served = tokio::spawn(serves);
    let (heard, error) = conversation.hold_over(client).await;
    assert!(error.is_none(), "{error:?}");
    served.await.unwrap();
    heard
}

/// One client over a faulty link; its replies, and whether it was cut short.
async fn disturbed(
    server: &LocalServer,
    conversation: Conversation,
    mut random: Random,
) -> impl Future<Output = (Vec<Heard>, Option<ConnectionError>)> + Send + use<> {
    let [there, back] = [(); 2].map(|()| WayFaults::drawn(&mut random, LEN));
    let (stream, serves) = server.connect().unwrap();
    let (client, passes) = faulty_pipe(stream, there, back, random);
    tokio::spawn(serves);
    tokio::spawn(passes);
    async move { conversation.hold_over(client).await }
}

/// Client that connects twice: on a second connection it sends all its bytes at once, and reads only the
/// end.
async fn duplicate(
    server: &LocalServer,
    conversation: &Conversation,
) -> impl Future<Output = ()> + Send + use<> {
    let (mut client, serves) = server.connect().unwrap();
    let all = conversation.frames().concat();
    tokio::spawn(serves);
    async move {
        let (mut from, mut to) = tokio::io::split(&mut client);
        let sends = async {
            to.write_all(&all).await.unwrap();
            to.shutdown().await.unwrap();
        };
        let mut heard = Vec::new();
        let (_, read) = tokio::join!(sends, from.read_to_end(&mut heard));
        assert!(read.unwrap() > 0, "the requests sent before the end are answered");
    }
}

fn is_clean(error: &ConnectionError) -> bool {
    matches!(
        error,
        ConnectionError::Closed { .. } | ConnectionError::Frame(_) | ConnectionError::Io(_)
    )
}

async fn play(
    seed: u64,
    server: &LocalServer,
    conversation: &Conversation,
    expected: &[Heard],
) -> bool {
    let mut random = Random::new(seed);
    let mut clients = JoinSet::new();
    for _ in 0..1 + random.below(3) {
        let own = Random::new(random.number());
        clients.spawn(disturbed(server, conversation.clone(), own).await);
    }
    if random.below(4) == 0 {
        let again = duplicate(server, conversation).await;
        tokio::spawn(again).await.unwrap();
    }
    let mut whole = true;
    while let Some(outcome) = clients.join_next().await {
        let (heard, error) = outcome.unwrap();
        // The server may say what it did not like before it closes.
        let heard: Vec<Heard> =
            heard.into_iter().filter(|h| !matches!(h, Heard::Rejected(..))).collect();
        assert_eq!(heard, expected[..heard.len()], "seed {seed}");
        assert!(error.as_ref().is_none_or(is_clean), "seed {seed}: {error:?}");
        whole &= heard.len() == expected.len();
    }
    whole
}

#[test]
fn thousands_of_seeded_faults_end_in_the_same_bits_or_a_clean_end_and_leave_nothing_behind() {
    within(LIMIT, "seeded faults", || {
        let seeds = std::env::var("SEEDS").ok().map(|text| text.parse().expect("a number"));
        let first = std::env::var("SEED").ok().map_or(0, |text| text.parse().expect("a number"));
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
        runtime.unwrap().block_on(async {
            let server = LocalServer::new(config(1)).unwrap();
            let conversation = Conversation::small();
            let expected = undisturbed(&server, &conversation).await;
            let mut whole = 0;
            let seeds = seeds.unwrap_or(SEEDS);
            for seed in first..first + seeds {
                whole += u64::from(play(seed, &server, &conversation, &expected).await);
            }
            println!("{whole} of {seeds} seeds ended without an early end");
            // Both kinds of end occur, or the links were not what they should be.
            assert!(seeds < 100 || (seeds / 20..seeds).contains(&whole), "{whole} of {seeds}");
            // The last sessions end when their links do.
            tokio::time::sleep(Duration::from_secs(24 * 3600)).await;
            while number(&server, "softgrasp_queued_requests ") > 0.0 {
                std::thread::yield_now();
            }
            assert_eq!(number(&server, "softgrasp_sessions "), 0.0);
            assert_eq!(number(&server, "softgrasp_reserved_bytes "), 0.0);
            assert_eq!(number(&server, "softgrasp_models "), 1.0);
            assert_eq!(undisturbed(&server, &conversation).await, expected, "it still answers");
        });
    });
}
