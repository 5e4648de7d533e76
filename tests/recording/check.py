"""Reads a recording with the reader of the MCAP project, and writes it again with compressed chunks."""

import json
import sys
from pathlib import Path

import jsonschema
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

recording, folder = Path(sys.argv[1]), Path(sys.argv[2])
validators = {}
counts = {}
frames = set()
drawn = set()
log_times = []
messages = []
with recording.open("rb") as file:
    for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False):
        assert schema.encoding == "jsonschema" and channel.message_encoding == "json", channel.topic
        validator = validators.setdefault(schema.id, jsonschema.Draft202012Validator(json.loads(schema.data)))
        value = json.loads(message.data)
        validator.validate(value)
        counts[(channel.topic, schema.name)] = counts.get((channel.topic, schema.name), 0) + 1
        if schema.name == "foxglove.FrameTransforms":
            for transform in value["transforms"]:
                frames.add(transform["child_frame_id"])
                turn = transform["rotation"]
                assert abs(sum(turn[c] ** 2 for c in "xyzw") - 1.0) < 1e-9, transform
        if schema.name == "foxglove.SceneUpdate":
            for entity in value["entities"]:
                drawn.add(entity["id"])
                for triangles in entity["triangles"]:
                    points = len(triangles["points"])
                    assert points > 3 and all(0 <= index < points for index in triangles["indices"])
                    assert len(triangles["indices"]) % 3 == 0
        if schema.name == "foxglove.Log":
            assert value["message"] and value["level"] == 2, value
        messages.append((schema, channel, message))
        log_times.append(message.log_time)

assert [m.sequence for _, _, m in messages] == list(range(len(messages))), "sequence numbers are not in order"
for name in ("foxglove.FrameTransforms", "foxglove.SceneUpdate", "foxglove.Log", "softgrasp.JointAngles"):
    assert any(schema == name for _, schema in counts), f"no {name} among {counts}"
assert len(frames) == 17 and {"palm", "object", "thumb/distal"} <= frames, frames
assert frames == drawn, f"{frames ^ drawn} move or are drawn alone"

for name, compression in (("zstd", CompressionType.ZSTD), ("lz4", CompressionType.LZ4)):
    with (folder / f"{name}.mcap").open("wb") as file:
        writer = Writer(file, compression=compression)
        writer.start()
        schemas, channels = {}, {}
        for schema, channel, message in messages:
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, "json", schemas[schema.id])
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence
            )
        writer.finish()
print(f"recording: {len(messages)} messages on {len(counts)} topics; {len(frames)} frames move and are drawn")
