//! Exports of other vendors: not read, but known by name.

use taxel_ground::InputError;

/// Beginning of an OLE file, such as a spreadsheet of old, as text.
const OLE: &str = "\u{fffd}\u{fffd}\u{11}\u{871}";

/// The product whose export has this line near its top.
pub(super) fn of_line(line: &str) -> Option<&'static str> {
    let line = line.trim().to_ascii_lowercase();
    let line = line.trim_start_matches(['"', '\u{feff}']);
    let begins = |start: &str| line.starts_with(start);
    if line.starts_with(OLE) {
        return Some("footscan (a spreadsheet)");
    }
    if begins("file name:") && line.contains("date/time") {
        let insole = line.contains(".sol") || line.contains(".fgt");
        return Some(if insole {
            "novel pedar"
        } else {
            "novel pliance"
        });
    }
    if begins("frame ") && line.contains(" ms)") {
        return Some("footscan");
    }
    if begins("sole_id,") {
        return Some("stappone");
    }
    let emed = begins("page ") || begins("file:") && line.contains("matrix:");
    emed.then_some("novel emed")
}

/// The refusal of lines that are what a board sends, as a log has them, and no table: objects of JSON,
/// or lines with the time of a serial monitor before them. `None` of all others.
pub(super) fn refused_log(file: &str, line: &str) -> Option<InputError> {
    let line = line.trim_start();
    let what = if line.starts_with('{') {
        "objects of JSON, one a line"
    } else if line.starts_with(|c: char| c.is_ascii_digit()) && line.contains(" -> ") {
        "a log of lines with the time at which each came"
    } else {
        return None;
    };
    let help = format!(
        "taxel listen {file} -o board.toml drafts a board file of such lines, and says how to play them with it"
    );
    Some(InputError::whole(file, format!("these are {what}, and no table")).help(help))
}

/// The refusal of an export of `vendor`.
pub(super) fn refused(file: &str, vendor: &str) -> InputError {
    InputError::whole(file, format!("this looks like an export of {vendor}, which is not read")).help(
        "convert it to raw channels. With the readings in a NumPy array `p` (frame, row, column), in kPa, and the \
         times `t` in s:\n  \
         _, rows, columns = p.shape\n  \
         head = \"# pitch = 5 mm\\ntime [s],\" + \",\".join(f\"r{r}c{c} [kPa]\" for r in range(rows) for c in range(columns))\n  \
         numpy.savetxt(\"map.csv\", numpy.column_stack([t, p.reshape(len(t), -1)]), delimiter=\",\", header=head, comments=\"\")\n\
         the guide to live touch (docs/book/live.md) has an example",
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::super::Recording;

    #[test]
    fn exports_of_other_vendors_are_named() {
        // The first lines of exports of each product.
        let cases: [(&[u8], &str); 6] = [
            (
                b"\r\n\t\t\t\tPage 1\r\n\r\n\tFile: C:\\novel\\novfile\\data\\EMED\\2.dat \tMatrix: 64x95 \r\n",
                "novel emed",
            ),
            (
                b"file name:  3DI_S001_V2_FE_2.sol\tdate/time  25.04.23 10.49\nsensor type:  y-1865l\n",
                "novel pedar",
            ),
            (
                b"file name: 2112170R_1.mat date/time 17.06.23 15.21\nmat type s2160_001\n",
                "novel pliance",
            ),
            (b"Frame 0 (2.00 ms)\n0\t0\t1.5\n", "footscan"),
            (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\0\0\0\0\0\0\0\0>\0\x03\0\n", "footscan"),
            (b"sole_id,timestamp,accel_x,accel_y\n1,1768494979568,-1780,-387\n", "stappone"),
        ];
        for (bytes, product) in cases {
            let error = Recording::open("a", bytes).unwrap_err().to_string();
            assert!(
                error.contains(&format!("an export of {product}")),
                "{error}"
            );
            assert!(error.contains("numpy.savetxt"), "{error}");
        }
    }
}
