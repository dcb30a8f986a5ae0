"use strict";
// Reads the packed blocks and arrays of a page: base64, deflate (RFC 1951), and differences down the columns undone.
(function () {
  const LENGTH = [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258];
  const LENGTH_BITS = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0];
  const BACK = [1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097,
    6145, 8193, 12289, 16385, 24577];
  const BACK_BITS = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13];
  const ORDER = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

  function huffman(lengths) {
    const count = new Uint16Array(16), start = new Uint16Array(17), symbol = new Uint16Array(lengths.length);
    for (const length of lengths) count[length] += 1;
    count[0] = 0;
    for (let i = 1; i < 16; i++) start[i + 1] = start[i] + count[i];
    lengths.forEach((length, value) => { if (length) symbol[start[length]++] = value; });
    return { count, symbol };
  }

  function inflated(source, size) {
    const out = new Uint8Array(size);
    let at = 0, held = 0, have = 0, filled = 0;
    const bits = (n) => {
      while (have < n) { held |= source[at++] << have; have += 8; }
      const value = held & ((1 << n) - 1);
      held >>>= n; have -= n;
      return value;
    };
    const next = ({ count, symbol }) => { // canonical code, one bit at a time
      let code = 0, first = 0, index = 0;
      for (let length = 1; length < 16; length++) {
        code |= bits(1);
        if (code - count[length] < first) return symbol[index + code - first];
        index += count[length]; first = (first + count[length]) << 1; code <<= 1;
      }
      throw new Error("packed data are damaged");
    };
    const fixed = () => [huffman(Array.from({ length: 288 }, (_, i) => i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8)),
      huffman(new Array(30).fill(5))];
    const dynamic = () => {
      const literals = bits(5) + 257, distances = bits(5) + 1, codes = bits(4) + 4, lengths = new Array(19).fill(0), all = [];
      for (let i = 0; i < codes; i++) lengths[ORDER[i]] = bits(3);
      const tree = huffman(lengths);
      while (all.length < literals + distances) {
        const symbol = next(tree);
        if (symbol < 16) all.push(symbol);
        else if (symbol === 16) { const last = all.at(-1); for (let n = bits(2) + 3; n; n--) all.push(last); }
        else for (let n = symbol === 17 ? bits(3) + 3 : bits(7) + 11; n; n--) all.push(0);
      }
      return [huffman(all.slice(0, literals)), huffman(all.slice(literals))];
    };
    for (let last = 0; !last;) {
      last = bits(1);
      const kind = bits(2);
      if (kind === 0) { // stored
        held = have = 0;
        const length = source[at] | source[at + 1] << 8;
        out.set(source.subarray(at + 4, at + 4 + length), filled); at += 4 + length; filled += length;
        continue;
      }
      const [words, distances] = kind === 1 ? fixed() : dynamic();
      for (let symbol = next(words); symbol !== 256; symbol = next(words)) {
        if (symbol < 256) { out[filled++] = symbol; continue; }
        let length = LENGTH[symbol - 257] + bits(LENGTH_BITS[symbol - 257]);
        const d = next(distances), back = BACK[d] + bits(BACK_BITS[d]);
        for (; length; length--, filled++) out[filled] = out[filled - back];
      }
    }
    return out;
  }

  function unpacked(text, size) {
    const raw = atob(text), source = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) source[i] = raw.charCodeAt(i);
    return inflated(source, size);
  }

  // The text of a block: as it stands, or deflated where the block says its size.
  window.ToolpointText = function (id) {
    const block = document.getElementById(id);
    if (!block) return "";
    return block.dataset.size ? new TextDecoder().decode(unpacked(block.textContent, Number(block.dataset.size))) : block.textContent;
  };

  // packed: {z: base64 of deflate, size: bytes, width: bytes a number, columns: 0 as it is, or k columns of differences}
  window.ToolpointData = function (packed) {
    const bytes = unpacked(packed.z, packed.size);
    if (!packed.columns) return bytes.buffer;
    const { columns, width } = packed, count = packed.size / width, rows = count / columns;
    const out = new { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[width](count);
    for (let c = 0, i = 0; c < columns; c++) {
      let sum = 0;
      for (let r = 0; r < rows; r++, i++) {
        let step = 0;
        for (let b = width - 1; b >= 0; b--) step = step << 8 | bytes[b * count + i];
        sum = out[r * columns + c] = sum + step >>> 0;
      }
    }
    return out.buffer;
  };
})();
