//! What a shared-memory server tells without being asked: its layout and its vehicles, as the attributes of a service that
//! nobody connects to. A client that got no answer reads this one place, however much servers that were killed left behind.

use iceoryx2::node::{Node, NodeState};
use iceoryx2::prelude::{AttributeSpecifier, Config, MessagingPattern};
use iceoryx2::service::Service;
use iceoryx2::service::port_factory::event;

use super::ShmError;
use super::layout::{Names, SERVED_LAYOUT, SERVED_VEHICLES, VERSION};

/// iceoryx2 gives a service eight attributes, of which the layout takes one.
const MAX_LISTS: usize = 7;
/// Longest value of an attribute.
const MAX_LIST_LEN: usize = 256;

/// What a server tells of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Served {
    /// Version of its layout.
    pub layout: String,
    /// The vehicles that it serves.
    pub vehicles: Vec<String>,
}

/// Tells clients of these vehicles for as long as what it returns lives. Attributes are fixed, so that another set of vehicles
/// takes another service, and the one before has to be dropped first.
pub fn tell<S: Service>(
    node: &Node<S>,
    names: &Names,
    vehicles: &[String],
) -> Result<event::PortFactory<S>, ShmError> {
    let name = names.served();
    let failed = |reason: &dyn std::fmt::Display| ShmError::new(&name)(reason);
    let attribute = |told: AttributeSpecifier, key: &str, value: &str| {
        let (key, value) =
            (key.try_into().map_err(|e| failed(&e))?, value.try_into().map_err(|e| failed(&e))?);
        told.define(&key, &value).map_err(|e| failed(&e))
    };
    let mut told = attribute(AttributeSpecifier::new(), SERVED_LAYOUT, VERSION)?;
    for list in lists(vehicles) {
        told = attribute(told, SERVED_VEHICLES, &list)?;
    }
    let service = name.as_str().try_into().map_err(|error| failed(&error))?;
    let builder = node.service_builder(&service).event();
    // nobody connects, and each place takes memory
    let builder = builder.max_listeners(1).max_notifiers(1).max_nodes(1);
    builder.create_with_attributes(&told).map_err(|error| failed(&error))
}

/// What the server of a namespace tells; none where none that lives tells anything.
pub fn served<S: Service>(names: &Names) -> Option<Served> {
    let service = names.served().as_str().try_into().ok()?;
    let details = S::details(&service, Config::global_config(), MessagingPattern::Event).ok()??;
    let nodes = details.dynamic_details?.nodes;
    nodes.iter().find(|node| matches!(node, NodeState::Alive(_)))?;
    let values = |key: &str| {
        let attributes = details.static_details.attributes().iter();
        let of_key = attributes.filter(|attribute| attribute.key() == key);
        of_key.map(|attribute| attribute.value().to_string()).collect::<Vec<_>>()
    };
    let vehicles = values(SERVED_VEHICLES).join(" ");
    Some(Served {
        layout: values(SERVED_LAYOUT).concat(),
        vehicles: vehicles.split_whitespace().map(str::to_owned).collect(),
    })
}

/// The vehicles' names in as few texts as they fit in; those that find no room are left out.
fn lists(vehicles: &[String]) -> Vec<String> {
    let mut lists: Vec<String> = Vec::new();
    for vehicle in vehicles {
        match lists.last_mut().filter(|list| list.len() + 1 + vehicle.len() <= MAX_LIST_LEN) {
            Some(list) => *list += &format!(" {vehicle}"),
            None => lists.push(vehicle.clone()),
        }
    }
    lists.truncate(MAX_LISTS);
    lists
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use iceoryx2::prelude::ipc;

    use super::*;

    #[test]
    fn more_names_than_one_attribute_holds_are_told() {
        let names = Names::new(&format!("told-{}", std::process::id()));
        let node = super::super::node::<ipc::Service>().unwrap();
        assert_eq!(served::<ipc::Service>(&names), None);
        // 40 names of 40 letters: 6 fit into 256 with their spaces
        let vehicles: Vec<String> = (0..40).map(|i| format!("{i:040}")).collect();
        let service = tell(&node, &names, &vehicles).unwrap();
        let expected = Served { layout: VERSION.into(), vehicles: vehicles.clone() };
        assert_eq!(served::<ipc::Service>(&names), Some(expected));
        drop(service);
        assert_eq!(served::<ipc::Service>(&names), None);
        // 7 attributes of 6 names: what does not fit is left out, and the rest is told
        let many: Vec<String> = (0..60).map(|i| format!("{i:040}")).collect();
        let _service = tell(&node, &names, &many).unwrap();
        assert_eq!(served::<ipc::Service>(&names).unwrap().vehicles, many[..42]);
    }
}
