//! Promise: over TLS a server and its callers know each other, a role allows what it names and nothing else, and what is renewed
//! on disk holds without a restart.

use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wade::config::Config;
use wade::service::access::{Role, Token};
use wade_client::{ClientError, Credentials, GrpcClient, Method, reload};
use wade_wire::State;
use wade_wire::proto::ReloadRequest;

use crate::common::{PATIENCE, Served};

/// Names under which the server may be called.
const OURS: &str = "subjectAltName=DNS:localhost,IP:127.0.0.1";

/// An authority made by openssl, and what it signs.
struct Authority {
    folder: TempDir,
}

fn openssl(folder: &Path, arguments: &[&str]) {
    let output = Command::new("openssl").args(arguments).current_dir(folder).output().expect("openssl runs");
    assert!(output.status.success(), "openssl {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

const CURVE: [&str; 5] = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"];

impl Authority {
    fn new() -> Self {
        let folder = TempDir::new().expect("a folder");
        let request =
            ["req", "-x509", "-days", "2", "-subj", "/CN=ca", "-keyout", "ca.key", "-out", "ca.pem"];
        openssl(folder.path(), &[&request[..], &CURVE].concat());
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes NAME.pem and NAME.key, signed for so many days from now, with these extensions.
    fn signs(&self, name: &str, days: i32, extensions: &str) {
        let [subject, key, request, certificate, extended] = [
            format!("/CN={name}"),
            format!("{name}.key"),
            format!("{name}.csr"),
            format!("{name}.pem"),
            format!("{name}.ext"),
        ];
        std::fs::write(self.path(&extended), format!("{extensions}\n")).expect("written");
        let asks = ["req", "-subj", &subject, "-keyout", &key, "-out", &request];
        openssl(self.folder.path(), &[&asks[..], &CURVE].concat());
        let days = days.to_string();
        let signs = ["x509", "-req", "-in", &request, "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial"];
        let as_what = ["-days", &days, "-extfile", &extended, "-out", &certificate];
        openssl(self.folder.path(), &[&signs[..], &as_what].concat());
    }

    /// What a client shows that has this certificate, and believes this authority.
    fn credentials(&self, name: Option<&str>) -> Credentials {
        let files = name.map(|name| [self.path(&format!("{name}.pem")), self.path(&format!("{name}.key"))]);
        let [certificate, key] = [0, 1].map(|i| files.as_ref().map(|files| files[i].as_path()));
        Credentials::from_files(Some(&self.path("ca.pem")), certificate, key, None).expect("read")
    }

    /// A server with the certificate of this name.
    fn serves(&self, name: &str, change: impl FnOnce(&mut Config)) -> Served {
        Served::with(|config| {
            config.tls.certificate = self.path(&format!("{name}.pem"));
            config.tls.key = self.path(&format!("{name}.key"));
            change(config);
        })
    }
}

fn url(served: &Served) -> String {
    let address = served.running.grpc_address().expect("TCP is on");
    format!("https://localhost:{}", address.port())
}

fn ask(served: &Served, credentials: &Credentials) -> Result<[f32; 3], String> {
    let client = GrpcClient::connect(&url(served), "husky", Method::Unary, PATIENCE, credentials);
    let answer = client.and_then(|mut client| client.evaluate(&State { depth: 0.15, ..State::default() }));
    answer.map_err(|error| error.to_string()).map(|answer| {
        let force = answer.wrench.and_then(|wrench| wrench.force_n).expect("a force");
        [force.x, force.y, force.z]
    })
}

fn administer(served: &Served, credentials: &Credentials) -> Result<usize, ClientError> {
    let request = ReloadRequest { vehicle: "husky".into(), bundle: String::new() };
    reload(&url(served), request, PATIENCE, credentials).map(|reloaded| reloaded.len())
}

/// An answer of HTTP by curl's own TLS, its status last.
fn curl(address: SocketAddr, authority: &Authority, path: &str, more: &[&str]) -> String {
    let url = format!("https://localhost:{}{path}", address.port());
    let ca = authority.path("ca.pem").display().to_string();
    let output = Command::new("curl")
        .args(["-sS", "-w", "\n%{http_code}", "--cacert", &ca])
        .args(more)
        .arg(url)
        .output()
        .expect("curl runs");
    String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned()
}

/// What openssl's own client says of a handshake with gRPC.
fn handshake(served: &Served, more: &[&str]) -> String {
    let address = served.running.grpc_address().expect("TCP is on").to_string();
    let mut command = Command::new("openssl");
    command.args(["s_client", "-connect", &address, "-alpn", "h2"]).args(more).stdin(Stdio::null());
    let output = command.output().expect("openssl runs");
    String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned()
}

fn credentials_with(authority: &Authority, token: &str) -> Credentials {
    Credentials { token: Some(token.to_owned()), ..authority.credentials(None) }
}

#[test]
fn over_tls_the_answer_is_the_same_and_another_authority_a_wrong_name_or_an_expired_certificate_is_refused() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    authority.signs("elsewhere", 2, "subjectAltName=DNS:elsewhere");
    authority.signs("expired", -1, OURS);
    let served = authority.serves("server", |_| {});
    let encrypted = ask(&served, &authority.credentials(None)).expect("answered");
    let mut unix = served.unix("husky", Method::Unary);
    let plain = unix.evaluate(&State { depth: 0.15, ..State::default() }).expect("answered");
    let plain = plain.wrench.and_then(|wrench| wrench.force_n).expect("a force");
    assert_eq!(encrypted.map(f32::to_bits), [plain.x, plain.y, plain.z].map(f32::to_bits));
    let refused = ask(&served, &Authority::new().credentials(None)).expect_err("another authority");
    assert!(refused.contains("UnknownIssuer") || refused.contains("BadSignature"), "{refused}");
    for (name, says) in [("elsewhere", "not valid for name"), ("expired", "Expired")] {
        let served = authority.serves(name, |_| {});
        let refused = ask(&served, &authority.credentials(None)).expect_err(name);
        assert!(refused.contains(says), "{refused}");
    }
}

#[test]
fn nothing_older_than_tls_1_3_and_nothing_without_tls_is_answered() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    let served = authority.serves("server", |_| {});
    assert!(handshake(&served, &["-tls1_3"]).contains("TLSv1.3"));
    let older = handshake(&served, &["-tls1_2"]);
    assert!(older.contains("alert protocol version"), "{older}");
    let other = handshake(&served, &["-alpn", "http/1.1"]);
    assert!(other.contains("no application protocol"), "{other}");
    let address = served.running.grpc_address().expect("TCP is on");
    let plain = GrpcClient::tcp(&format!("http://{address}"), "husky", Method::Unary, PATIENCE);
    let plain = plain.and_then(|mut client| client.vehicle().map(drop)).expect_err("refused").to_string();
    assert!(plain.contains("https://"), "says the way out: {plain}");
    // who says nothing has as long as every other handshake
    let silent = TcpStream::connect(address).expect("connected");
    ask(&served, &authority.credentials(None)).expect("answered meanwhile");
    drop(silent);
}

#[test]
fn a_listener_that_never_shakes_hands_costs_a_client_its_timeout() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!("https://{}", listener.local_addr().expect("an address"));
    let patience = Duration::from_millis(200);
    let credentials = Authority::new().credentials(None);
    let connected = GrpcClient::connect(&url, "husky", Method::Unary, patience, &credentials);
    let error = connected.map(drop).expect_err("never answered").to_string();
    assert!(error.contains("no connection within 200 ms"), "{error}");
}

#[test]
fn a_certificate_allows_what_its_names_were_given() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    authority.signs("rig", 2, "extendedKeyUsage=clientAuth");
    authority.signs("chief", 2, "subjectAltName=URI:spiffe://lab/chief\nextendedKeyUsage=clientAuth");
    authority.signs("guest", 2, "extendedKeyUsage=clientAuth");
    authority.signs("expired", -1, "extendedKeyUsage=clientAuth");
    authority.signs("other-use", 2, "extendedKeyUsage=serverAuth");
    let other = Authority::new();
    other.signs("rig", 2, "extendedKeyUsage=clientAuth");
    let served = authority.serves("server", |config| {
        config.tls.client_ca = authority.path("ca.pem");
        let roles = &mut config.access.certificates;
        roles.insert("rig".into(), vec![Role::Query]);
        roles.insert("spiffe://lab/chief".into(), vec![Role::Query, Role::Administer]);
    });
    let shows = |name| authority.credentials(Some(name));
    ask(&served, &shows("rig")).expect("answered");
    assert_eq!(administer(&served, &shows("chief")).expect("administered"), 1);
    let refused = administer(&served, &shows("rig")).expect_err("refused").to_string();
    assert!(
        refused.contains("PermissionDenied") && refused.contains("\"rig\"") && refused.contains("administer"),
        "{refused}"
    );
    let refused = ask(&served, &shows("guest")).expect_err("refused");
    assert!(refused.contains("PermissionDenied") && refused.contains("\"guest\""), "{refused}");
    let refused = ask(&served, &authority.credentials(None)).expect_err("refused");
    assert!(refused.contains("Unauthenticated") && refused.contains("certificate"), "{refused}");
    for name in ["expired", "other-use"] {
        ask(&served, &shows(name)).expect_err(name);
    }
    // the name is right and the authority is not
    let forged = Credentials { ca: authority.credentials(None).ca, ..other.credentials(Some("rig")) };
    ask(&served, &forged).expect_err("forged");
    let refused = |name| served.running.metrics().render().contains(&format!("reason=\"{name}\"}} 0"));
    assert!(!refused("no_tls"), "failed handshakes are counted");
    // the owner of the process needs nothing
    served.unix("husky", Method::Unary).evaluate(&State::still(0.0)).expect("answered");
}

#[test]
fn no_session_is_resumed_so_that_each_connection_shows_a_certificate_that_holds() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    let served = authority.serves("server", |_| {});
    let (address, session) = (served.running.http_address().expect("HTTP is on"), authority.path("session"));
    let mut command = Command::new("openssl");
    command.args(["s_client", "-quiet", "-connect", &address.to_string(), "-sess_out"]).arg(&session);
    let mut client =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("openssl");
    let asks = b"GET /livez HTTP/1.0\r\n\r\n";
    std::io::Write::write_all(client.stdin.as_mut().expect("piped"), asks).expect("written");
    let answer = client.wait_with_output().expect("ended").stdout;
    assert!(String::from_utf8_lossy(&answer).contains("200 OK"));
    assert!(!session.exists(), "there is nothing to resume");
}

#[test]
fn a_token_allows_what_it_was_given_until_it_is_taken_out_of_the_file() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    let file = authority.path("tokens.toml");
    let rig = Token::add(&file, "rig", &[Role::Query]).expect("added");
    let served = authority.serves("server", |config| config.access.tokens.clone_from(&file));
    ask(&served, &credentials_with(&authority, &rig)).expect("answered");
    let refused = administer(&served, &credentials_with(&authority, &rig)).expect_err("refused").to_string();
    assert!(refused.contains("token \"rig\"") && refused.contains("administer"), "{refused}");
    let refused = ask(&served, &credentials_with(&authority, "guessed")).expect_err("refused");
    assert!(refused.contains("Unauthenticated") && !refused.contains("guessed"), "{refused}");
    // added, and taken out, while the server runs
    let chief = Token::add(&file, "chief", &[Role::Administer]).expect("added");
    until("the new token is known", || administer(&served, &credentials_with(&authority, &chief)).is_ok());
    let text = std::fs::read_to_string(&file).expect("read");
    let (_, without_rig) = text.split_once("\n\n").expect("two entries");
    std::fs::write(&file, without_rig).expect("written");
    until("the old token is not", || ask(&served, &credentials_with(&authority, &rig)).is_err());
    // a file that is broken changes nothing
    std::fs::write(&file, "token = 3").expect("written");
    std::thread::sleep(Duration::from_secs(3));
    administer(&served, &credentials_with(&authority, &chief)).expect("administered");
}

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn a_certificate_that_is_renewed_on_disk_is_shown_to_the_next_caller() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    let served = authority.serves("server", |_| {});
    let credentials = authority.credentials(None);
    let mut open = GrpcClient::connect(&url(&served), "husky", Method::Unary, PATIENCE, &credentials)
        .expect("connected");
    // one of them is there before the other: neither half is used
    std::fs::copy(authority.path("ca.key"), authority.path("server.key")).expect("copied");
    std::thread::sleep(Duration::from_secs(3));
    ask(&served, &credentials).expect("the one before stays");
    authority.signs("server", 1, OURS);
    let expiry = || {
        let shown = handshake(&served, &["-showcerts"]);
        let certificate = shown.split("-----END CERTIFICATE-----").next().expect("one");
        certificate.rsplit("-----BEGIN CERTIFICATE-----").next().expect("one").trim().to_owned()
    };
    let file = std::fs::read_to_string(authority.path("server.pem")).expect("read");
    until("the new certificate is shown", || file.contains(&expiry()));
    ask(&served, &credentials).expect("answered");
    open.evaluate(&State::still(0.0)).expect("a connection lives on");
    assert!(served.running.metrics().render().contains("wade_certificate_end_seconds{file="));
    // the server asks itself over TLS
    std::thread::sleep(Duration::from_secs(3));
    assert!(served.running.health().is_ready());
}

#[test]
fn the_page_metrics_and_queries_need_their_roles_and_probes_need_none() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    let file = authority.path("tokens.toml");
    let [rig, watch] = [("rig", Role::Query), ("watch", Role::Observe)]
        .map(|(name, role)| Token::add(&file, name, &[role]).expect("added"));
    let served = authority.serves("server", |config| config.access.tokens.clone_from(&file));
    let address = served.running.http_address().expect("HTTP is on");
    let get = |path: &str, more: &[&str]| curl(address, &authority, path, more);
    let bearer = |token: &str| format!("Authorization: Bearer {token}");
    let (rig, watch) = (bearer(&rig), bearer(&watch));
    for path in ["/livez", "/readyz"] {
        assert!(get(path, &[]).ends_with("\n200"), "{path}");
    }
    for (path, allowed, refused) in [
        ("/metrics", &watch, &rig),
        ("/v1/latency", &watch, &rig),
        ("/v1/streams", &watch, &rig),
        ("/v1/vehicles", &rig, &watch),
        ("/", &rig, &watch),
    ] {
        assert!(get(path, &[]).ends_with("\n401"), "{path}");
        assert!(get(path, &["-H", allowed]).ends_with("\n200"), "{path}");
        assert!(get(path, &["-H", refused]).ends_with("\n403"), "{path}");
    }
    // what a browser does with a password
    let password = format!("me:{}", rig.rsplit(' ').next().expect("a token"));
    assert!(get("/v1/vehicles", &["-u", &password]).ends_with("\n200"));
    assert!(get("/v1/vehicles", &["-i"]).to_lowercase().contains("www-authenticate: basic"));
}

#[test]
fn what_an_administrator_does_is_in_the_log_with_his_name_and_what_was_refused_too() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    let file = authority.path("tokens.toml");
    let chief = Token::add(&file, "chief", &[Role::Administer]).expect("added");
    let settings = format!(
        "[tls]\ncertificate = \"{0}/server.pem\"\nkey = \"{0}/server.key\"\n[access]\ntokens = \"{0}/tokens.toml\"\n\
         [log]\njson = true\n",
        authority.folder.path().display()
    );
    std::fs::write(authority.path("wade.toml"), settings).expect("written");
    let log = std::fs::File::create(authority.path("log")).expect("a file");
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(["serve", "--with-parent", "--shm", "off", "--listen", "127.0.0.1:0", "--http", ""]);
    command
        .args(["--unix-socket", "wade.sock", "--config", "wade.toml"])
        .current_dir(authority.folder.path());
    let mut server = command.stderr(log).stdout(Stdio::null()).spawn().expect("the server starts");
    let read = || std::fs::read_to_string(authority.path("log")).unwrap_or_default();
    until("ready", || read().contains("ready in"));
    let log = read();
    let port = log.split_once("https://127.0.0.1:").expect("an address").1.split('"').next().expect("a port");
    let ask = |token: &str| {
        let request = ReloadRequest { vehicle: "husky".into(), bundle: String::new() };
        let credentials = credentials_with(&authority, token);
        reload(&format!("https://localhost:{port}"), request, PATIENCE, &credentials)
    };
    // more than the limit of lines of one kind
    for _ in 0..15 {
        ask(&chief).expect("administered");
    }
    ask("guessed").expect_err("refused");
    kill(&server, nix::sys::signal::Signal::SIGHUP);
    until("SIGHUP", || read().contains("\"by\":\"SIGHUP\""));
    let log = read();
    let lines: Vec<&str> = log.lines().filter(|line| line.contains("wade::audit")).collect();
    let by_chief =
        lines.iter().filter(|line| line.contains("token \\\"chief\\\"") && line.contains("reload husky"));
    assert_eq!(by_chief.count(), 15, "{log}");
    assert!(
        log.contains("an administrator's call was refused") && log.contains("the token is not known"),
        "{log}"
    );
    assert!(!log.contains(&chief) && !log.contains("guessed"), "{log}");
    kill(&server, nix::sys::signal::Signal::SIGTERM);
    assert!(server.wait().expect("reaped").success());
}

fn kill(server: &std::process::Child, signal: nix::sys::signal::Signal) {
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(server.id().cast_signed()), signal).expect("sent");
}

#[test]
fn files_that_cannot_be_used_are_refused_at_the_start_by_name() {
    let authority = Authority::new();
    authority.signs("server", 2, OURS);
    let refusal = |change: &dyn Fn(&mut Config)| {
        let mut config = Config::default();
        config.grpc.listen = "127.0.0.1:0".into();
        config.tls.certificate = authority.path("server.pem");
        config.tls.key = authority.path("server.key");
        change(&mut config);
        config.validate().expect("the settings fit");
        wade::server::start(&config).map(drop).expect_err("refused").to_string()
    };
    std::fs::write(authority.path("empty.pem"), "").expect("written");
    for (names, error) in [
        ("tls.certificate", refusal(&|c| c.tls.certificate = authority.path("nowhere.pem"))),
        ("tls.certificate", refusal(&|c| c.tls.certificate = authority.path("empty.pem"))),
        ("tls.key", refusal(&|c| c.tls.key = authority.path("ca.key"))),
        ("tls.key", refusal(&|c| c.tls.key = authority.path("ca.pem"))),
        (
            "tls.client_ca",
            refusal(&|c| {
                c.tls.client_ca = authority.path("empty.pem");
                c.access.certificates.insert("*".into(), vec![Role::Query]);
            }),
        ),
        ("access.tokens", refusal(&|c| c.access.tokens = authority.path("nowhere.toml"))),
    ] {
        assert!(error.contains(names) && error.contains('/'), "{error}");
    }
}
