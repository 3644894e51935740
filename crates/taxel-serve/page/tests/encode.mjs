// Writes a frame of the live protocol, for the mock server and the tests of the decoder.

const CONTACT_NUMBERS = 20;

/** One binary message. Missing totals are NaN, missing counts 0, and every taxel counts. */
export function encodeFrame(frame) {
  const contacts = frame.contacts ?? [];
  const n = frame.state.length;
  const channels = frame.reading.length;
  const components = frame.components ?? 1;
  const length = 216 + 8 * CONTACT_NUMBERS * contacts.length + 5 * channels + n * (6 + 8 * components);
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
  put("setUint32", 4, 0x354c5854);
  put("setUint16", 2, components);
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
  doubles([frame.sum ?? Number.NaN]);
  put("setUint32", 4, n);
  put("setUint32", 4, channels);
  put("setUint32", 4, frame.flags ?? 0);
  put("setUint32", 4, frame.leftOut ?? 0);
  put("setBigUint64", 8, frame.hostNs ?? 2n ** 64n - 1n);
  put("setUint32", 4, frame.uncertain ?? 0);
  put("setUint8", 1, frame.totalCertainty ?? 0);
  put("setUint8", 1, frame.totalReason ?? 255);
  put("setUint16", 2, 0);
  for (const contact of contacts) {
    if (contact.length !== CONTACT_NUMBERS) {
      throw new Error(`a contact has ${contact.length} numbers, not ${CONTACT_NUMBERS}`);
    }
    doubles(contact);
  }
  const missing = frame.state.map(() => Number.NaN);
  for (const values of [frame.reading, frame.value, frame.deviation, frame.residual ?? missing]) floats(values);
  octets(frame.channelState ?? frame.reading.map(() => 0));
  octets(frame.state);
  octets(frame.counted ?? frame.state.map(() => 1));
  if (offset !== length) throw new Error(`wrote ${offset} of ${length} bytes`);
  return view.buffer;
}
