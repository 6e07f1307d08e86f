// Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

// Reads a recording with @mcap/core, by its index and from end to end, and compares with its metadata.yaml:
// the files, and the messages of every topic. Usage: node read_with_mcap_core.mjs BAG, beside an installed
// node_modules; exit code 0 when all agrees.

import { open, readFile, readdir } from "node:fs/promises";
import { join } from "node:path";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { FileHandleReadable } from "@mcap/nodejs";
import { parse } from "yaml";

const decompressHandlers = await loadDecompressHandlers();

/** Number of messages by topic, in the order of log time, by the index at the end of the file. */
async function countByIndex(path) {
  const handle = await open(path);
  try {
    const reader = await McapIndexedReader.Initialize({ readable: new FileHandleReadable(handle), decompressHandlers });
    const counts = {};
    let last = 0n;
    for await (const message of reader.readMessages()) {
      if (message.logTime < last) throw new Error(`${path}: a message of ${message.logTime} ns after ${last} ns`);
      last = message.logTime;
      count(counts, reader.channelsById.get(message.channelId));
    }
    return counts;
  } finally {
    await handle.close();
  }
}

/** Number of messages by topic, reading every record and checking every checksum. */
async function countByStream(path) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(await readFile(path));
  const channels = new Map();
  const counts = {};
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Message") count(counts, channels.get(record.channelId));
  }
  if (!reader.done()) throw new Error(`${path}: breaks off`);
  return counts;
}

function count(counts, channel) {
  counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
}

function expectEqual(what, found, expected) {
  const [ours, theirs] = [found, expected].map((counts) => JSON.stringify(Object.entries(counts).sort()));
  if (ours !== theirs) throw new Error(`${what}: ${ours}, the metadata says ${theirs}`);
}

const [bag] = process.argv.slice(2);
const metadata = parse(await readFile(join(bag, "metadata.yaml"), "utf8")).rosbag2_bagfile_information;
const files = (await readdir(bag)).filter((name) => name.endsWith(".mcap"));
expectEqual("files", files.sort(), [...metadata.relative_file_paths].sort());

const total = {};
for (const { path, message_count: expected } of metadata.files) {
  const counts = await countByIndex(join(bag, path));
  expectEqual(`${path} from end to end`, await countByStream(join(bag, path)), counts);
  const sum = Object.values(counts).reduce((one, other) => one + other, 0);
  expectEqual(path, { messages: sum }, { messages: expected });
  for (const [topic, messages] of Object.entries(counts)) total[topic] = (total[topic] ?? 0) + messages;
}
const topics = metadata.topics_with_message_count.map((entry) => [entry.topic_metadata.name, entry.message_count]);
expectEqual("topics", total, Object.fromEntries(topics));
for (const [topic, messages] of Object.entries(total).sort()) console.log(`${String(messages).padStart(6)} ${topic}`);
