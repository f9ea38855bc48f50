//! What a certificate says of its holder. Its signature is checked before anybody looks at it here.

use std::time::SystemTime;

use x509_cert::Certificate;
use x509_cert::der::Decode;
use x509_cert::ext::pkix::SubjectAltName;
use x509_cert::ext::pkix::name::GeneralName;

/// The names of the holder: those of DNS, e-mail and URI (RFC 5280, section 4.2.1.6), and the common name of the subject, each
/// once.
pub fn names_in(der: &[u8]) -> Vec<String> {
    let Ok(certificate) = Certificate::from_der(der) else { return Vec::new() };
    let holder = certificate.tbs_certificate();
    let mut names: Vec<String> = Vec::new();
    if let Ok(Some((_, SubjectAltName(others)))) = holder.get_extension::<SubjectAltName>() {
        names.extend(others.iter().filter_map(|name| match name {
            GeneralName::DnsName(name)
            | GeneralName::Rfc822Name(name)
            | GeneralName::UniformResourceIdentifier(name) => Some(name.to_string()),
            _ => None,
        }));
    }
    if let Ok(Some(name)) = holder.subject().common_name() {
        let name = name.value().into_owned();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// When a certificate expires.
pub fn not_after(der: &[u8]) -> Result<SystemTime, x509_cert::der::Error> {
    Ok(Certificate::from_der(der)?.tbs_certificate().validity().not_after.to_system_time())
}
