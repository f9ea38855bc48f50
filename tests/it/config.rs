//! Promise: a configuration that cannot work is refused before any port is bound, naming the key.

use wade::config::Config;

fn refusal(change: impl FnOnce(&mut Config)) -> String {
    let mut config = Config::default();
    change(&mut config);
    config.validate().expect_err("refused").to_string()
}

#[test]
fn the_defaults_are_valid() {
    Config::default().validate().expect("valid");
}

#[test]
fn a_value_out_of_range_is_named() {
    assert!(refusal(|c| c.drain_s = f64::NAN).contains("drain_s"));
    assert!(refusal(|c| c.latency_window_s = 0.0).contains("latency_window_s"));
    assert!(refusal(|c| c.grpc.threads = 0).contains("grpc.threads"));
    assert!(refusal(|c| c.grpc.max_batch = 0).contains("grpc.max_batch"));
    assert!(refusal(|c| c.grpc.max_connections = 0).contains("grpc.max_connections"));
    assert!(refusal(|c| c.grpc.peer_share = 0.0).contains("grpc.peer_share"));
    assert!(refusal(|c| c.grpc.peer_share = f64::NAN).contains("grpc.peer_share"));
    assert!(refusal(|c| c.grpc.stream_idle_s = f64::INFINITY).contains("grpc.stream_idle_s"));
    assert!(refusal(|c| c.grpc.control_frames_per_s = 0.0).contains("grpc.control_frames_per_s"));
    assert!(refusal(|c| c.http.max_connections = 0).contains("http.max_connections"));
    assert!(refusal(|c| c.http.request_s = 0.0).contains("http.request_s"));
    assert!(refusal(|c| c.shm.namespace = "a/b".into()).contains("shm.namespace"));
    assert!(refusal(|c| c.shm.max_clients = 0).contains("shm.max_clients"));
    let nowhere = refusal(|c| {
        c.grpc.listen.clear();
        c.grpc.unix_socket = std::path::PathBuf::new();
        c.shm.enabled = false;
    });
    assert!(nowhere.contains("shm.enabled"));
}

#[test]
fn what_other_machines_reach_is_encrypted_or_said_to_be_insecure() {
    for open in ["0.0.0.0:1", "[::]:1", "10.0.0.7:1", "[::ffff:10.0.0.7]:1"] {
        let refused = refusal(|c| c.grpc.listen = open.into());
        assert!(refused.contains("grpc.insecure") && refused.contains("tls.certificate"), "{refused}");
        assert!(refusal(|c| c.http.listen = open.into()).contains("http.insecure"));
        let mut config = Config::default();
        (config.grpc.listen, config.http.listen) = (open.into(), open.into());
        (config.grpc.insecure, config.http.insecure) = (true, true);
        config.validate().expect("said to be insecure");
    }
    for inside in ["127.0.0.2:1", "[::1]:1", "[::ffff:127.0.0.1]:1"] {
        let mut config = Config::default();
        config.grpc.listen = inside.into();
        config.validate().expect(inside);
    }
}

#[test]
fn settings_of_access_that_do_not_go_together_are_named() {
    use wade::service::access::Role;
    assert!(refusal(|c| c.tls.certificate = "c.pem".into()).contains("tls.key"));
    assert!(refusal(|c| c.tls.key = "k.pem".into()).contains("tls.certificate"));
    assert!(refusal(|c| c.tls.client_ca = "ca.pem".into()).contains("tls.certificate"));
    let nobody = refusal(|c| {
        (c.tls.certificate, c.tls.key) = ("c.pem".into(), "k.pem".into());
        c.tls.client_ca = "ca.pem".into();
    });
    assert!(nobody.contains("access.certificates"), "{nobody}");
    let named = refusal(|c| {
        c.access.certificates.insert("rig".into(), vec![Role::Query]);
    });
    assert!(named.contains("tls.client_ca"), "{named}");
    let everybody = refusal(|c| {
        c.access.tokens = "tokens.toml".into();
        c.grpc.admin_over_tcp = true;
    });
    assert!(everybody.contains("grpc.admin_over_tcp"), "{everybody}");
}

#[test]
fn a_physics_that_is_none_is_refused_with_file_key_and_what_there_is() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let path = folder.path().join("wade.toml");
    std::fs::write(&path, "physics = \"fast\"\n").expect("written");
    let message = Config::read(&path).expect_err("refused").to_string();
    for part in ["wade.toml", "physics = \"fast\"", "`hydrostatic`", "`quasi_steady`", "`full`"] {
        assert!(message.contains(part), "{message}");
    }
    std::fs::write(&path, "physics = \"quasi_steady\"\n").expect("written");
    assert_eq!(Config::read(&path).expect("sound").physics, wade_core::physics::Physics::QuasiSteady);
}

#[test]
fn an_address_that_is_none_is_refused_and_never_binds_another() {
    let mut config = Config::default();
    config.grpc.listen = "localhost".into();
    let error = wade::server::start(&config).expect_err("refused").to_string();
    assert!(error.contains("grpc.listen"), "{error}");
}
