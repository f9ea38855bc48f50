//! Why a request over HTTP got no answer, as status and JSON.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};
use tonic::Code;

use wade_wire::Refusal;

/// Why a request got no answer.
#[derive(Debug, thiserror::Error)]
pub enum Rejection {
    /// The query was refused as over any transport.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// Not JSON, or not the message it should be.
    #[error("{}{reason}", prefix(.field))]
    Malformed {
        /// Where, empty for the whole body.
        field: String,
        /// What is wrong.
        reason: String,
    },
    /// The body is longer than a query can be.
    #[error("the body is longer than {limit} bytes; longer batches go over gRPC or shared memory")]
    TooLong {
        /// The limit [bytes].
        limit: usize,
    },
    /// The hull is too large for a page.
    #[error(
        "the hull has {triangles} triangles, more than the {limit} that are sent; look at hull.stl in its bundle"
    )]
    HullTooLarge {
        /// Faces of the hull.
        triangles: usize,
        /// The limit.
        limit: usize,
    },
    /// No stream of this number is open.
    #[error("stream {id} is not open; /v1/streams lists those that are")]
    NoSuchStream {
        /// Its number.
        id: u64,
    },
    /// The version cannot be read.
    #[error("version {version}: {reason}; /v1/vehicles/NAME/versions lists those that there are")]
    NoSuchVersion {
        /// Its number.
        version: u32,
        /// Why not.
        reason: String,
    },
    /// Called by a name that is not known to be this machine's.
    #[error(
        "this server is not known as \"{host}\": call it by its address or as localhost, or add the name to http.hosts"
    )]
    ForeignHost {
        /// The name.
        host: String,
    },
    /// A browser asks on behalf of another site.
    #[error("a page of another site may not ask this server")]
    ForeignSite,
    /// Nothing there.
    #[error(
        "there is /, /v1/query, /v1/batch, /v1/stability, /v1/vehicles, /v1/vehicles/NAME, /v1/vehicles/NAME/hull, /v1/vehicles/NAME/versions, /v1/streams, /v1/streams/ID, /v1/latency, /metrics, /livez and /readyz"
    )]
    NoSuchPath,
}

fn prefix(field: &str) -> String {
    if field.is_empty() { String::new() } else { format!("{field}: ") }
}

impl Rejection {
    fn code(&self) -> Code {
        match self {
            Self::Refused(refusal) => refusal.code(),
            Self::Malformed { .. } => Code::InvalidArgument,
            Self::TooLong { .. } => Code::ResourceExhausted,
            Self::HullTooLarge { .. } => Code::FailedPrecondition,
            Self::ForeignHost { .. } | Self::ForeignSite => Code::PermissionDenied,
            Self::NoSuchStream { .. } | Self::NoSuchVersion { .. } | Self::NoSuchPath => Code::NotFound,
        }
    }

    /// The status that gRPC's codes have in HTTP; a message over the limit has one of its own there.
    fn status(&self) -> (StatusCode, &'static str) {
        match self.code() {
            Code::NotFound => (StatusCode::NOT_FOUND, "NOT_FOUND"),
            Code::Unauthenticated => (StatusCode::UNAUTHORIZED, "UNAUTHENTICATED"),
            Code::PermissionDenied => (StatusCode::FORBIDDEN, "PERMISSION_DENIED"),
            Code::FailedPrecondition => (StatusCode::BAD_REQUEST, "FAILED_PRECONDITION"),
            Code::Unavailable => (StatusCode::SERVICE_UNAVAILABLE, "UNAVAILABLE"),
            Code::DeadlineExceeded => (StatusCode::GATEWAY_TIMEOUT, "DEADLINE_EXCEEDED"),
            Code::ResourceExhausted if matches!(self, Self::TooLong { .. }) => {
                (StatusCode::PAYLOAD_TOO_LARGE, "RESOURCE_EXHAUSTED")
            }
            Code::ResourceExhausted => (StatusCode::TOO_MANY_REQUESTS, "RESOURCE_EXHAUSTED"),
            _ => (StatusCode::BAD_REQUEST, "INVALID_ARGUMENT"),
        }
    }

    fn violations(&self) -> Vec<Value> {
        match self {
            Self::Refused(refusal) => refusal.details().bad_request().map_or_else(Vec::new, |bad| {
                let violation =
                    |v: &tonic_types::FieldViolation| json!({"field": v.field, "description": v.description});
                bad.field_violations.iter().map(violation).collect()
            }),
            Self::Malformed { field, reason } => vec![json!({"field": field, "description": reason})],
            _ => Vec::new(),
        }
    }
}

impl IntoResponse for Rejection {
    fn into_response(self) -> Response {
        let (status, name) = self.status();
        let error = json!({
            "code": status.as_u16(),
            "status": name,
            "message": self.to_string(),
            "field_violations": self.violations(),
        });
        let mut response =
            (status, [(header::CONTENT_TYPE, "application/json")], json!({"error": error}).to_string())
                .into_response();
        if status == StatusCode::UNAUTHORIZED {
            // a browser asks its user for a password, which is the token
            response.headers_mut().insert(
                header::WWW_AUTHENTICATE,
                HeaderValue::from_static("Basic realm=\"wade: any name, and a token as password\""),
            );
        }
        if matches!(status, StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE) {
            // whole seconds are all that the header can say
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from_static("1"));
        }
        response
    }
}
