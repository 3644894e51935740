//! The address of the page as a QR code, for a telephone.

use std::net::{IpAddr, Ipv4Addr, UdpSocket};

use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;

/// The address with its token as lines of half blocks, below the address that a telephone can open;
/// nothing for one that is too long for a code.
pub(super) fn drawn(page: &str) -> String {
    let page = reachable(page);
    let Ok(code) = QrCode::new(&page) else {
        return String::new();
    };
    // On a dark terminal the quiet zone is light: most readers take no inverted code.
    let code = code
        .render::<Dense1x2>()
        .dark_color(Dense1x2::Light)
        .light_color(Dense1x2::Dark)
        .build();
    format!("{page}\n{code}\n")
}

/// The address with that of this machine in its network in place of "all addresses".
fn reachable(page: &str) -> String {
    let all = format!("//{}:", Ipv4Addr::UNSPECIFIED);
    match own_address() {
        Some(address) if page.contains(&all) => page.replacen(&all, &format!("//{address}:"), 1),
        _ => page.to_owned(),
    }
}

/// The address from which this machine would send to others; nothing is sent.
fn own_address() -> Option<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    // Of the documentation (RFC 5737): any address beyond this network.
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9)).ok()?;
    Some(socket.local_addr().ok()?.ip())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_is_as_wide_as_its_modules_and_quiet_zone() {
        let page = "http://192.168.7.9:7117/?token=0123456789abcdef0123456789abcdef";
        let text = drawn(page);
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some(page));
        let widths: Vec<usize> = lines.map(|line| line.chars().count()).collect();
        // A code of version n has 17 + 4n modules and four light ones on each side; a line has two rows.
        let width = widths[0];
        assert!(width > 25 && (width - 25).is_multiple_of(4), "{width}");
        assert_eq!(widths, vec![width; width.div_ceil(2)]);
    }

    #[test]
    fn an_address_that_names_all_is_that_of_this_machine() {
        let page = reachable("http://0.0.0.0:7117/?token=a");
        // A machine without a network keeps it.
        assert!(
            page.starts_with("http://") && page.ends_with(":7117/?token=a"),
            "{page}"
        );
        assert_eq!(reachable("http://127.0.0.1:1/"), "http://127.0.0.1:1/");
    }
}
