//! `glove-client solve` at a server of before: what that server does not know is refused before it is asked.

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use softgrasp_protocol::blocking::Connection;
use softgrasp_protocol::{Limits, Reply, Request, Welcome};

use crate::start::{Folder, fail};

/// A server that welcomes everybody, knows no capability by name, and answers nothing else.
struct OlderServer {
    address: SocketAddr,
    /// Requests besides the introduction.
    asked: Arc<AtomicUsize>,
}

impl OlderServer {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let asked = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&asked);
        std::thread::spawn(move || {
            for client in listener.incoming().map_while(Result::ok) {
                Self::welcome(client, &counted);
            }
        });
        Self { address, asked }
    }

    fn welcome(client: TcpStream, asked: &AtomicUsize) {
        let limits = Limits::default();
        let mut connection = Connection::new(client, limits);
        while let Ok(Some(frame)) = connection.read_frame() {
            let Ok(Request::Hello(_)) = Request::decode(&frame, &limits) else {
                asked.fetch_add(1, Ordering::SeqCst);
                return;
            };
            let (server, version) = ("fea-server".to_owned(), "0.0.9".to_owned());
            let welcome = Reply::Welcome(Welcome { server, version, ..Welcome::default() });
            let mut bytes = Vec::new();
            welcome.encode_into(frame.request_id(), &limits, &mut bytes).unwrap();
            connection.write_bytes(&bytes).unwrap();
        }
    }

    /// What `solve` says where it refuses to ask this server.
    fn refusal(&self, arguments: &[&str]) -> String {
        let address = self.address.to_string();
        let said = fail(1, &[&["solve", "--server", &address], arguments].concat());
        assert_eq!(self.asked.load(Ordering::SeqCst), 0, "{said}");
        assert!(said.contains("fea-server 0.0.9 is an older server"), "{said}");
        said
    }
}

/// One tetrahedron with a mid-edge node off the middle of its edge.
const TEN_NODES: &str = "*NODE
1, 0, 0, 0
2, 0.02, 0, 0
3, 0, 0.02, 0
4, 0, 0, 0.02
5, 0.01, -0.001, 0
6, 0.01, 0.01, 0
7, 0, 0.01, 0
8, 0, 0, 0.01
9, 0.01, 0, 0.01
10, 0, 0.01, 0.01
*ELEMENT, TYPE=C3D10
1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
";

#[test]
fn server_of_before_is_not_asked_for_what_it_does_not_know() {
    let (server, folder) = (OlderServer::start(), Folder::new());
    let mesh = folder.write("ten.inp", TEN_NODES);
    let known = folder.write("K.csv", "node,ux,uy,uz\n0,0,0,0\n1,0,0,0\n2,0,0,0\n3,,,-0.001\n");
    let out = folder.path("U.csv");
    let files = ["--mesh", &mesh, "--known", &known, "--out", &out];
    let of = |more: &[&str]| server.refusal(&[&files[..], more].concat());

    let said = of(&["--element", "t10"]);
    assert!(said.contains("no mid-edge nodes; take --element t4"), "{said}");
    let said = of(&["--element", "t4", "--gravity", "0,0,-9.81", "--density", "1000"]);
    assert!(said.contains("no weight and no pressure"), "{said}");
    let slope = folder.write("S.csv", "node,ux,uy,uz\n3,1,0,0\n");
    let gradient = folder.path("G.csv");
    let asked = ["--gradient", &gradient, "--gradient-by", &slope];
    let said = of(&[&["--element", "t4"], &asked[..]].concat());
    assert!(said.contains("no derivatives; leave out --gradient"), "{said}");
}
