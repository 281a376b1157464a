// The packed model of a page: see pipelines/reports/page/packing.py for the layout of its bytes.

const TYPES = { f4: Float32Array, i2: Int16Array, i4: Int32Array, u1: Uint8Array };

/** Decode the text of a packed model: base64, gzip, head, arrays. */
export async function readModel(text) {
  const bytes = await unpacked(text);
  const length = new DataView(bytes).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const arrays = head.arrays.map((entry) => readArray(bytes, 4 + length, entry));
  return resolved(head, arrays);
}

/** Return the bytes of a gzipped text in base64. */
export async function unpacked(text) {
  const stream = new Blob([fromBase64(text.trim())]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

function fromBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

/** Return one array; differences between rows are added up, modulo the size of the type. */
function readArray(bytes, begin, entry) {
  const count = entry.shape.reduce((product, size) => product * size, 1);
  const values = new TYPES[entry.type](bytes, begin + entry.at, count);
  if (entry.delta && entry.shape.length > 0) {
    const row = count / Math.max(entry.shape[0], 1);
    for (let i = row; i < count; i++) values[i] += values[i - row];
  }
  return values;
}

/** Put the arrays where the head names them; places become metres. */
function resolved(value, arrays) {
  if (Array.isArray(value)) return value.map((one) => resolved(one, arrays));
  if (value === null || typeof value !== "object") return value;
  if ("array" in value) return arrays[value.array];
  const own = {};
  for (const [name, one] of Object.entries(value)) if (name !== "arrays") own[name] = resolved(one, arrays);
  if ("step" in own) return Float32Array.from(own.values, (steps) => steps * own.step);
  return own;
}
