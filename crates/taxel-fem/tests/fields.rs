//! scratch
use std::time::Instant;
use taxel_fem::field::cases::*;

#[test]
fn scratch() {
    for level in 1..=3 {
        for (r, c) in [(0.1, 0.830644062), (1.0, 1.56340192), (100.0, 4.25872722)] {
            let t = Instant::now();
            let x = coplanar_strips(r, c, level).unwrap();
            println!(
                "{level} {} {} {:.2e} {} {:?}",
                x.name,
                x.ours,
                x.error(),
                x.cells,
                t.elapsed()
            );
        }
        for (r, c) in [(0.1, 0.85135115), (1.0, 2.11577897), (50.0, 52.16105440)] {
            let t = Instant::now();
            let x = opposed_strips(r, c, level).unwrap();
            println!(
                "{level} {} {} {:.2e} {} {:?}",
                x.name,
                x.ours,
                x.error(),
                x.cells,
                t.elapsed()
            );
        }
        for (r, c) in [(2.0, 5.5521089), (0.05, 68.9285251)] {
            let t = Instant::now();
            let x = coaxial_discs(r, c, level).unwrap();
            println!(
                "{level} {} {} {:.2e} {} {:?}",
                x.name,
                x.ours,
                x.error(),
                x.cells,
                t.elapsed()
            );
        }
        for x in [
            disc(level),
            sphere(level),
            corner_square(level),
            bars(100.0, 20.0, 50.0, 7.358201, level),
            bars(100.0, 20.0, 1700.0, 9.226891, level),
        ] {
            let t = Instant::now();
            let x = x.unwrap();
            println!(
                "{level} {} {} {:.2e} {} {:?}",
                x.name,
                x.ours,
                x.error(),
                x.cells,
                t.elapsed()
            );
        }
    }
}
