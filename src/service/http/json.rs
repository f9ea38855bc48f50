//! Messages as JSON by the rules of protobuf: names as in proto/ (their camelCase forms are read too), numbers may be
//! strings, fields that are not set are written with their defaults.

use std::sync::LazyLock;

use axum::http::header;
use axum::response::{IntoResponse, Response};
use prost_reflect::{
    DescriptorPool, DynamicMessage, FieldDescriptor, Kind, MessageDescriptor, SerializeOptions,
};
use serde_json::{Map, Value};

use super::rejection::Rejection;
use wade_wire::proto;

static POOL: LazyLock<DescriptorPool> =
    LazyLock::new(|| DescriptorPool::decode(proto::DESCRIPTORS).expect("the build wrote the descriptors"));

fn descriptor(name: &str) -> MessageDescriptor {
    POOL.get_message_by_name(name).expect("a message of proto/")
}

/// Reads a message of this name.
pub fn read<M: prost::Message + Default>(name: &str, text: &[u8]) -> Result<M, Rejection> {
    let mut deserializer = serde_json::Deserializer::from_slice(text);
    let mut track = serde_path_to_error::Track::new();
    let tracked = serde_path_to_error::Deserializer::new(&mut deserializer, &mut track);
    let message = DynamicMessage::deserialize(descriptor(name), tracked);
    let message = message.map_err(|error| malformed(name, &track.path().to_string(), &error.to_string()))?;
    deserializer.end().map_err(|error| malformed(name, "", &error.to_string()))?;
    message.transcode_to().map_err(|error| malformed(name, "", &error.to_string()))
}

fn malformed(message: &str, path: &str, reason: &str) -> Rejection {
    // a dot is the whole, a question mark what could not be read so far
    let field = path.trim_end_matches('?').trim_end_matches('.').to_owned();
    let unknown = reason.starts_with("unrecognized field");
    let known = unknown.then(|| message_at(message, &field)).flatten().map(|message| field_names(&message));
    let reason = known.map_or_else(|| reason.to_owned(), |known| format!("{reason}; the fields are {known}"));
    Rejection::Malformed { field, reason }
}

/// The message at a path of field names, or around it where it leads to no message.
fn message_at(message: &str, path: &str) -> Option<MessageDescriptor> {
    let step = |message: MessageDescriptor, name: &str| match field(&message, name).map(|field| field.kind())
    {
        Some(Kind::Message(inner)) => inner,
        _ => message,
    };
    Some(path.split('.').filter(|name| !name.is_empty()).fold(POOL.get_message_by_name(message)?, step))
}

fn field(message: &MessageDescriptor, name: &str) -> Option<FieldDescriptor> {
    message.get_field_by_name(name).or_else(|| message.get_field_by_json_name(name))
}

fn field_names(message: &MessageDescriptor) -> String {
    message.fields().map(|field| field.name().to_owned()).collect::<Vec<_>>().join(", ")
}

/// Writes a message of this name.
pub fn write(name: &str, message: &impl prost::Message) -> Response {
    let options = SerializeOptions::new()
        .use_proto_field_name(true)
        .skip_default_fields(false)
        .stringify_64_bit_integers(false);
    let mut text = Vec::new();
    let mut dynamic = DynamicMessage::new(descriptor(name));
    dynamic.transcode_from(message).expect("a message of its own descriptor");
    let mut serializer = serde_json::Serializer::pretty(&mut text);
    dynamic.serialize_with_options(&mut serializer, &options).expect("memory takes any text");
    text.push(b'\n');
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

/// Writes a document that is no message.
pub fn document(document: &impl serde::Serialize) -> Response {
    let mut text = serde_json::to_vec_pretty(document).expect("numbers, text and lists alone");
    text.push(b'\n');
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

/// The same on one line, for long ones.
pub fn compact(document: &impl serde::Serialize) -> Response {
    let text = serde_json::to_vec(document).expect("numbers, text and lists alone");
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

/// The JSON of a message of this name whose fields stand in the parameters of a URL, by path: `state.depth_m=0.2`. A
/// field that repeats is given as often as it has values.
pub fn from_parameters(name: &str, parameters: &str) -> Result<Vec<u8>, Rejection> {
    let mut root = Map::new();
    for (path, value) in form_urlencoded::parse(parameters.as_bytes()) {
        insert(&mut root, descriptor(name), &path, &value)
            .map_err(|reason| Rejection::Malformed { field: path.into_owned(), reason })?;
    }
    Ok(Value::Object(root).to_string().into_bytes())
}

fn insert(
    object: &mut Map<String, Value>,
    message: MessageDescriptor,
    path: &str,
    value: &str,
) -> Result<(), String> {
    let (first, rest) = path.split_once('.').map_or((path, None), |(first, rest)| (first, Some(rest)));
    let unknown = || format!("unrecognized field name '{first}'; the fields are {}", field_names(&message));
    let field = field(&message, first).ok_or_else(unknown)?;
    match (field.kind(), rest) {
        (Kind::Message(inner), Some(rest)) if !field.is_list() => {
            let entry = object.entry(first).or_insert_with(|| Value::Object(Map::new()));
            match entry {
                Value::Object(entry) => insert(entry, inner, rest, value),
                _ => Err(format!("{first} is a message")),
            }
        }
        (Kind::Message(inner), _) => Err(format!("name one of its fields: {}", field_names(&inner))),
        (_, Some(_)) => Err(format!("{first} has no fields")),
        (kind, None) => put(object, &field, scalar(&kind, value), first),
    }
}

/// Numbers and names of enumerations are read from strings; booleans are not.
fn scalar(kind: &Kind, value: &str) -> Value {
    match (kind, value) {
        (Kind::Bool, "true") => Value::Bool(true),
        (Kind::Bool, "false") => Value::Bool(false),
        _ => Value::String(value.to_owned()),
    }
}

fn put(
    object: &mut Map<String, Value>,
    field: &FieldDescriptor,
    value: Value,
    name: &str,
) -> Result<(), String> {
    if field.is_list() {
        if let Value::Array(values) = object.entry(name).or_insert_with(|| Value::Array(Vec::new())) {
            values.push(value);
        }
        return Ok(());
    }
    match object.insert(name.to_owned(), value) {
        None => Ok(()),
        Some(_) => Err("given twice".into()),
    }
}
