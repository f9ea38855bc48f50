//! What keeps pages of other sites out. The server trusts whoever reaches its port, and a browser on this machine reaches
//! it for any page that it shows:
//!
//! - a name that its owner points at this machine once the page is loaded (DNS rebinding) would make the page one of ours,
//!   so that it could read hulls and forces: a name must be localhost or in `http.hosts`. A plain address cannot be pointed
//!   elsewhere.
//! - without a common origin a page can send but not read. Such requests are refused as well, for the time they would
//!   take; no answer carries a CORS header.
//!
//! Metrics and probes stay outside: Prometheus and Kubernetes call them by any name.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::Shared;
use super::rejection::Rejection;
use crate::metrics::Transport;

/// Sent with every answer. Scripts, styles and data come from here alone, and nobody may show the page in a frame.
const HEADERS: [(HeaderName, &str); 4] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// Refuses what comes from another site, and adds the headers to what is answered.
pub async fn check(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let asks = request.uri().path().starts_with("/v1/");
    let checked = known_host(&request, &shared.config.hosts)
        // a link from another site may lead to the page
        .and_then(|()| if asks { same_site(request.headers()) } else { Ok(()) });
    let mut response = match checked {
        Ok(()) => next.run(request).await,
        Err(rejection) => {
            shared.grpc.metrics.refuse(Transport::http, "permission_denied");
            rejection.into_response()
        }
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}

/// A request without a name (HTTP/1.0) is no browser's.
fn known_host(request: &Request, hosts: &[String]) -> Result<(), Rejection> {
    let named = request.headers().get(header::HOST).map(|host| host.to_str().unwrap_or("?"));
    let absolute = request.uri().authority().map(Authority::as_str);
    for host in [named, absolute].into_iter().flatten() {
        let authority = host.parse::<Authority>().ok();
        if !authority.as_ref().is_some_and(|authority| is_known(authority.host(), hosts)) {
            return Err(Rejection::ForeignHost { host: host.chars().take(64).collect() });
        }
    }
    Ok(())
}

fn is_known(host: &str, hosts: &[String]) -> bool {
    let address = host.trim_start_matches('[').trim_end_matches(']');
    address.parse::<IpAddr>().is_ok()
        || host.eq_ignore_ascii_case("localhost")
        || hosts.iter().any(|known| known.eq_ignore_ascii_case(host))
}

/// Browsers say where a request comes from; older ones at least name the origin. Other programs say neither.
fn same_site(headers: &HeaderMap) -> Result<(), Rejection> {
    let text = |name: HeaderName| headers.get(name).map(|value: &HeaderValue| value.to_str().unwrap_or("?"));
    let host = text(header::HOST).unwrap_or_default();
    let ours = match (text(HeaderName::from_static("sec-fetch-site")), text(header::ORIGIN)) {
        (Some(site), _) => matches!(site, "same-origin" | "none"),
        (None, Some(origin)) => origin.split_once("://").is_some_and(|(_, authority)| authority == host),
        (None, None) => true,
    };
    if ours { Ok(()) } else { Err(Rejection::ForeignSite) }
}
