//! Shipped studies.

const SHIPPED: &[(&str, &str)] = &[
    (
        "p1-resolution",
        include_str!("../studies/p1-resolution.toml"),
    ),
    ("p2-gaps", include_str!("../studies/p2-gaps.toml")),
    (
        "p2-electrodes",
        include_str!("../studies/p2-electrodes.toml"),
    ),
    ("p2-tolerance", include_str!("../studies/p2-tolerance.toml")),
    ("p2-after", include_str!("../studies/p2-after.toml")),
    ("p3-pitch", include_str!("../studies/p3-pitch.toml")),
    ("p3-places", include_str!("../studies/p3-places.toml")),
    ("p4-sections", include_str!("../studies/p4-sections.toml")),
];

/// Names of the shipped studies.
pub fn shipped_names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// Text of a shipped study.
pub fn shipped_text(name: &str) -> Option<&'static str> {
    let found = SHIPPED.iter().find(|(shipped, _)| *shipped == name);
    found.map(|(_, text)| *text)
}
