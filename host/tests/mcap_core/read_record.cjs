// Reads a record with npm's @mcap/core, by what the file says of itself, and prints as JSON what is in it.
//   node read_record.cjs FOLDER_OF_PACKAGES FILE.mcap
// Of each stream: how many rows, and SHA-256 of their times (doubles), sizes (32 bits each) and bytes.
"use strict";

const { createHash } = require("node:crypto");
const { createRequire } = require("node:module");
const { open, readFile } = require("node:fs/promises");
const path = require("node:path");

const [folder, file] = process.argv.slice(2);
const packages = createRequire(path.join(path.resolve(folder), "package.json"));
const { McapIndexedReader, McapStreamReader } = packages("@mcap/core");
const fzstd = packages("fzstd");
const protobuf = packages("protobufjs");
packages("protobufjs/ext/descriptor"); // adds Root.fromDescriptor

const decompressHandlers = { zstd: (data, size) => fzstd.decompress(data, new Uint8Array(Number(size))) };

function streamOf(streams, topic) {
  const sums = () => createHash("sha256");
  return (streams[topic] ??= { messages: 0, rows: 0, times: sums(), sizes: sums(), data: sums() });
}

function add(stream, block) {
  const rows = block.time.length;
  const sizes = block.size.length === 1 ? new Array(rows).fill(block.size[0]) : block.size;
  stream.messages += 1;
  stream.rows += rows;
  stream.times.update(Buffer.from(Float64Array.from(block.time).buffer));
  stream.sizes.update(Buffer.from(Uint32Array.from(sizes).buffer));
  stream.data.update(block.data);
}

/** From the first byte to the last one, without the index. */
function readAsStream(bytes) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const schemas = new Map(), channels = new Map(), attachments = {}, streams = {};
  reader.append(bytes);
  for (let record; (record = reader.nextRecord()) !== undefined; ) {
    if (record.type === "Schema") {
      schemas.set(record.id, protobuf.Root.fromDescriptor(record.data).lookupType(record.name));
    } else if (record.type === "Channel") {
      channels.set(record.id, record);
    } else if (record.type === "Attachment") {
      attachments[record.name] = createHash("sha256").update(record.data).digest("hex");
    } else if (record.type === "Message") {
      const channel = channels.get(record.channelId);
      add(streamOf(streams, channel.topic), schemas.get(channel.schemaId).decode(record.data));
    }
  }
  if (!reader.done()) throw new Error("the record has no end");
  for (const stream of Object.values(streams)) {
    for (const name of ["times", "sizes", "data"]) stream[name] = stream[name].digest("hex");
  }
  return { streams, attachments };
}

/** By the index at its end: messages of each stream. */
async function readByIndex() {
  const handle = await open(file);
  const readable = {
    size: async () => BigInt((await handle.stat()).size),
    read: async (offset, length) => (await handle.read(new Uint8Array(Number(length)), 0, Number(length), Number(offset))).buffer,
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const messages = {};
  for await (const message of reader.readMessages()) {
    const { topic } = reader.channelsById.get(message.channelId);
    messages[topic] = (messages[topic] ?? 0) + 1;
  }
  await handle.close();
  return messages;
}

async function main() {
  const read = readAsStream(await readFile(file));
  console.log(JSON.stringify({ ...read, messages_by_index: await readByIndex() }));
}

main();
