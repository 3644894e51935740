//! What is written of the shipped sensors: the reference of their keys, and their drawings.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use taxel::drawing::{TEXT_SIZE, text_width};
use taxel::sensor::Sensor;

#[test]
fn every_link_has_its_section() {
    let page = Sensor::reference();
    let anchors: Vec<_> = page
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| line.trim_start_matches(['#', ' ']).replace(['`', '.'], ""))
        .collect();
    let links = page.split("](#").skip(1);
    for target in links.filter_map(|rest| rest.split(')').next()) {
        assert!(anchors.iter().any(|anchor| anchor == target), "{target}");
    }
}

#[test]
fn quantities_have_their_range() {
    let page = Sensor::reference();
    for row in [
        "| `mount.cylinder.radius` | Radius of the surface that the taxels lie on, m. | a length, greater than 0 m and at most 10 m | yes |",
        "| `rows` | Rows of taxels, 1 to 256; row 0 is at +y. | a whole number, 1 to 256 | yes |",
        "\n### `element.microchannel`\n",
        "\n## `mask`\n",
    ] {
        assert!(page.contains(row), "{row}");
    }
}

/// Values of an attribute of an element.
fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let from = element.find(&format!("{name}=\""))? + name.len() + 2;
    element[from..].split('"').next()
}

/// Left, right and baseline of each text of a drawing, px, with the text itself.
fn texts(svg: &str) -> Vec<([f64; 3], String)> {
    let elements = svg.split("<text ").skip(1);
    let extent = |element: &str| {
        let number = |name| attribute(element, name).unwrap().parse::<f64>().unwrap();
        let (_, rest) = element.split_once('>').unwrap();
        let text = rest.split("</text>").next().unwrap().to_owned();
        let size = match attribute(element, "class").unwrap() {
            "title" => 16.0,
            "view" => 13.0,
            _ => TEXT_SIZE,
        };
        let width = text_width(&text, size);
        let left = match attribute(element, "text-anchor").unwrap() {
            "start" => number("x"),
            "middle" => number("x") - 0.5 * width,
            _ => number("x") - width,
        };
        ([left, left + width, number("y")], text)
    };
    elements.map(extent).collect()
}

#[test]
fn every_text_of_every_shipped_sensor_lies_in_its_drawing() {
    for name in Sensor::shipped_names() {
        let svg = Sensor::shipped(name)
            .unwrap()
            .device()
            .unwrap()
            .drawing()
            .svg();
        let size = attribute(&svg, "viewBox").unwrap();
        let size: Vec<f64> = size.split(' ').map(|side| side.parse().unwrap()).collect();
        let [0.0, 0.0, width, height] = size[..] else {
            panic!("{name}: viewBox {size:?}");
        };
        let texts = texts(&svg);
        assert!(texts.len() > 5, "{name}: {texts:?}");
        for ([left, right, baseline], text) in texts {
            assert!(
                left >= 0.0 && right <= width,
                "{name}: {text:?} from {left} to {right} px of {width}"
            );
            // A font reaches about its size above its baseline, and a quarter below.
            assert!(
                baseline >= 12.0 && baseline + 4.0 <= height,
                "{name}: {text:?} at {baseline} of {height} px"
            );
        }
    }
}
