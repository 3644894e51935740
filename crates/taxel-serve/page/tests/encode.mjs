// Writes a frame of the live protocol, for the mock server and the tests of the decoder.

const CONTACT_NUMBERS = 11;

/** One binary message. Missing totals are NaN, missing counts 0. */
export function encodeFrame(frame) {
  const contacts = frame.contacts ?? [];
  const n = frame.state.length;
  const channels = frame.kind === 3 ? 4 + 8 * frame.signal.length : 0;
  const length = 184 + (88 + 24) * contacts.length + channels + n * { 1: 47, 2: 5, 3: 9 }[frame.kind];
  const view = new DataView(new ArrayBuffer(length));
  let offset = 0;
  const put = (method, size, value) => {
    view[method](offset, value, true);
    offset += size;
  };
  const doubles = (values) => values.forEach((value) => put("setFloat64", 8, value));
  const floats = (values) => values.forEach((value) => put("setFloat32", 4, value));
  const octets = (values) => values.forEach((value) => put("setUint8", 1, value));
  const unknown = [Number.NaN, Number.NaN, Number.NaN];
  put("setUint32", 4, 0x314c5854);
  put("setUint16", 2, frame.kind);
  put("setUint16", 2, contacts.length);
  put("setBigUint64", 8, frame.sequence ?? 0n);
  put("setBigUint64", 8, frame.timeNs ?? 0n);
  put("setBigUint64", 8, BigInt(frame.lost ?? 0));
  put("setBigUint64", 8, BigInt(frame.late ?? 0));
  put("setBigUint64", 8, BigInt(frame.duplicate ?? 0));
  doubles([frame.rate ?? 0, frame.latency ?? 0]);
  doubles(frame.totalForce ?? unknown);
  doubles(frame.totalDeviation ?? unknown);
  doubles(frame.moment ?? unknown);
  doubles(frame.centre ?? unknown.slice(1));
  doubles(frame.centreCovariance ?? unknown);
  put("setUint32", 4, n);
  put("setUint32", 4, frame.flags ?? 0);
  for (const contact of contacts) {
    if (contact.length !== CONTACT_NUMBERS)
      throw new Error(`a contact has ${contact.length} numbers, not 11`);
    doubles(contact);
  }
  if (frame.kind === 1) {
    for (const values of [frame.capacitance, frame.force, frame.deviation, frame.residual]) floats(values);
    for (const values of [frame.state, frame.touching, frame.faulty]) octets(values);
  } else if (frame.kind === 3) {
    put("setUint32", 4, frame.signal.length);
    for (const values of [frame.signal, frame.rest, frame.value, frame.deviation]) floats(values);
    octets(frame.state);
  } else {
    floats(frame.value);
    octets(frame.state);
  }
  for (const [contact] of contacts.entries()) {
    doubles(frame.identities?.[contact] ?? [0, Number.NaN, Number.NaN]);
  }
  if (offset !== length) throw new Error(`wrote ${offset} of ${length} bytes`);
  return view.buffer;
}
