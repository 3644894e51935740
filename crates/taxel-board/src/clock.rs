//! Device time to the time of this computer, from one-way stamps.
//!
//! A reading arrives late, never early: the arrivals less the device times lie above a line
//! whose slope is the difference of the two clocks, and touch it where the path was fastest.
//! The lower convex hull of the last five minutes finds that line. See theory/acquisition.

use std::collections::VecDeque;

/// Stamps of how long a time the hull is of, ns.
const WINDOW_NS: u64 = 300_000_000_000;
/// The window must be so many times the spread of the delays before its slope is believed.
const TRUSTED: f64 = 30.0;
/// Arrivals so many spreads behind the map, for so long, are a break.
const BREAK_SPREADS: f64 = 5.0;
const BREAK_NS: u64 = 1_000_000_000;
/// The window is so many stretches, each with a hull of its own: with the oldest one goes all
/// that it says, and the others are still whole.
const STRETCHES: usize = 10;
const STRETCH_NS: f64 = WINDOW_NS as f64 / STRETCHES as f64;
/// Most points of the hull of a stretch; then the next one begins.
const MOST_POINTS: usize = 64;
/// Largest difference of two clocks that is believed, as a share.
const LARGEST_RATE: f64 = 2e-3;

/// Maps device time to host time.
///
/// ```
/// use taxel_board::DeviceClockMap;
///
/// let mut map = DeviceClockMap::new(None);
/// for step in 0..1000_u64 {
///     let device = step * 10_000_000;
///     let delay = 300_000 + (step * 7919 % 1000) * 1000;
///     map.push(device, 5_000_000_000 + device + delay);
/// }
/// let host = map.host(9_990_000_000).expect("there were stamps");
/// assert!((host.time_ns as i64 - 14_990_300_000).abs() < 100_000);
/// ```
#[derive(Debug, Clone)]
pub struct DeviceClockMap {
    /// Smallest and largest delay that the path has at least, ns, where the board file says it.
    delay: Option<[f64; 2]>,
    /// Device time, and host less device time, of the lower hull, ns from the first stamp.
    hull: Vec<[f64; 2]>,
    /// The hulls of the stretches of the window, the oldest first.
    stretches: VecDeque<Vec<[f64; 2]>>,
    origin: Option<[u64; 2]>,
    /// How far the arrivals have lately lain above the map, ns.
    spread: f64,
    last: Option<[u64; 2]>,
    far_since: Option<u64>,
    segments: u64,
    slope: f64,
}

/// A host time with its bound. How often the bound holds stands in theory/acquisition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HostTime {
    /// Time of the steady clock of this computer, ns.
    pub time_ns: u64,
    /// The reading was taken at most so long before, s; `None` where the smallest delay of the
    /// path is not known.
    pub before: Option<f64>,
    /// And at most so long behind, s.
    pub behind: f64,
}

/// What a stamp did to the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockEvent {
    /// It was added.
    Added,
    /// The clocks no longer belong together: a new segment begins with it.
    Segment,
}

impl DeviceClockMap {
    /// A map without stamps; `delay` is the smallest and the largest delay that the path has at
    /// least, s.
    pub fn new(delay: Option<[f64; 2]>) -> Self {
        Self {
            delay: delay.map(|delay| delay.map(|seconds| seconds * 1e9)),
            hull: Vec::new(),
            stretches: VecDeque::new(),
            origin: None,
            spread: 0.0,
            last: None,
            far_since: None,
            segments: 0,
            slope: 0.0,
        }
    }

    /// Segments so far, the present one included.
    pub fn segments(&self) -> u64 {
        self.segments
    }

    /// Difference of the clocks: host seconds in a device second, less 1; 0 until the window
    /// is long enough.
    pub fn rate_difference(&self) -> f64 {
        self.slope
    }

    /// Begins a new segment: after a reconnect or a restart of the board.
    pub fn reset(&mut self) {
        self.hull.clear();
        self.stretches.clear();
        self.origin = None;
        self.last = None;
        self.far_since = None;
        self.spread = 0.0;
        self.slope = 0.0;
    }

    /// Adds the device time and the arrival of a frame, ns.
    pub fn push(&mut self, device_ns: u64, host_ns: u64) -> ClockEvent {
        let back = self.last.is_some_and(|[device, _]| device_ns < device);
        let far = self.far_since(device_ns, host_ns);
        if back || far.is_some_and(|far| far >= BREAK_NS) {
            self.reset();
        } else if far.is_some() {
            // A pause of the link, or the begin of a break: it says nothing of the clocks.
            self.last = Some([device_ns, host_ns]);
            return ClockEvent::Added;
        }
        let [device_origin, host_origin] = *self.origin.get_or_insert([device_ns, host_ns]);
        let event = if self.hull.is_empty() {
            self.segments += 1;
            ClockEvent::Segment
        } else {
            ClockEvent::Added
        };
        let x = (device_ns - device_origin) as f64;
        let y = host_ns as f64 - host_origin as f64 - x;
        let base = self.offset_at(x);
        if let Some(base) = base {
            // Slowly forgotten, quickly learned: the spread of the delays lately.
            let above = (y - base).max(0.0);
            self.spread = above.max(self.spread * (1.0 - 1e-3));
        }
        self.add(x, y);
        self.last = Some([device_ns, host_ns]);
        event
    }

    /// For how long arrivals have been far from the map, ns.
    fn far_since(&mut self, device_ns: u64, host_ns: u64) -> Option<u64> {
        let [device_origin, host_origin] = self.origin.filter(|_| self.hull.len() > 1)?;
        let x = device_ns.saturating_sub(device_origin) as f64;
        let y = host_ns as f64 - host_origin as f64 - x;
        let base = self.offset_at(x).unwrap_or(y);
        if (y - base).abs() < BREAK_SPREADS * self.spread.max(1e6) {
            self.far_since = None;
            return None;
        }
        let since = *self.far_since.get_or_insert(host_ns);
        Some(host_ns.saturating_sub(since))
    }

    /// Keeps the lower convex hull of the window.
    fn add(&mut self, x: f64, y: f64) {
        let full = |stretch: &Vec<[f64; 2]>| {
            stretch.len() >= MOST_POINTS || x - stretch[0][0] >= STRETCH_NS
        };
        if self.stretches.back().is_none_or(full) {
            self.stretches.push_back(Vec::new());
        }
        if let Some(newest) = self.stretches.back_mut() {
            add_to_hull(newest, [x, y]);
        }
        let old = |stretch: &Vec<[f64; 2]>| x - stretch[0][0] > WINDOW_NS as f64;
        let mut gone = false;
        while self.stretches.len() > STRETCHES || self.stretches.front().is_some_and(old) {
            self.stretches.pop_front();
            gone = true;
        }
        if gone {
            self.hull.clear();
            for point in self.stretches.iter().flatten() {
                add_to_hull(&mut self.hull, *point);
            }
        } else {
            add_to_hull(&mut self.hull, [x, y]);
        }
        self.slope = self.new_slope().unwrap_or(self.slope);
    }

    /// Slope of the side of the hull over the middle of the window, once the window is long enough.
    fn new_slope(&self) -> Option<f64> {
        let (first, last) = (self.hull.first()?, self.hull.last()?);
        let window = last[0] - first[0];
        if window < TRUSTED * self.spread.max(1e5) {
            return None;
        }
        let mut sides = self.hull.iter().zip(self.hull.iter().skip(1));
        let middle = first[0] + 0.5 * window;
        let side = sides.rfind(|(from, to)| from[0] <= middle && middle <= to[0])?;
        let slope = (side.1[1] - side.0[1]) / (side.1[0] - side.0[0]);
        (slope.abs() < LARGEST_RATE).then_some(slope)
    }

    /// Host less device time at `x`, by the lowest line of this slope below all points.
    fn offset_at(&self, x: f64) -> Option<f64> {
        self.hull
            .iter()
            .map(|point| point[1] + self.slope * (x - point[0]))
            .reduce(f64::min)
    }

    /// Host time of a device time of this segment; `None` before the first stamp.
    pub fn host(&self, device_ns: u64) -> Option<HostTime> {
        let [device_origin, host_origin] = self.origin?;
        let x = device_ns as f64 - device_origin as f64;
        let offset = self.offset_at(x)?;
        // How far the points of the hull lie from the line: its own scatter.
        let scatter = self
            .hull
            .iter()
            .map(|point| point[1] + self.slope * (x - point[0]) - offset)
            .fold(0.0, f64::max);
        let [least, most] = self.delay.unwrap_or([0.0; 2]);
        let known = self.delay.is_some();
        let time = host_origin as f64 + x + offset - if known { 0.5 * (least + most) } else { 0.0 };
        let half = 0.5 * (most - least);
        Some(HostTime {
            time_ns: time.max(0.0) as u64,
            before: known.then_some((half + scatter) * 1e-9),
            behind: (half + scatter) * 1e-9,
        })
    }
}

/// Adds a point behind all others to a lower convex hull.
fn add_to_hull(hull: &mut Vec<[f64; 2]>, [x, y]: [f64; 2]) {
    while let [.., before, last] = hull[..] {
        let rises = (last[1] - before[1]) * (x - before[0]);
        if rises < (y - before[1]) * (last[0] - before[0]) {
            break;
        }
        hull.pop();
    }
    hull.push([x, y]);
}
