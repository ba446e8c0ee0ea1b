// Any bytes as a file of keyframes: it is read to its end or to a named reason, what is skipped is what would have been
// read, and what was read is written to a file that holds the same.
#include <filesystem>
#include <string>
#include <vector>

#include "frontend/capture/keyframe_file.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using namespace relmap::capture;
using fuzzing::must;

std::vector<Bytes> read_all(KeyframeFileReader& reader) {
  std::vector<Bytes> keyframes;
  for (;;) {
    const auto keyframe = reader.next();
    if (!keyframe.ok())
      must(fuzzing::is_one_of(
          keyframe.reason(), {Reason::TRUNCATED, Reason::CORRUPT, Reason::BAD_SIZE, Reason::UNKNOWN_PROTOCOL_VERSION}));
    if (!keyframe.ok() || !*keyframe) return keyframes;
    must(reader.position() <= reader.bytes());
    keyframes.push_back(encode_keyframe(**keyframe));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const storage::TemporaryFolder kFolder;
  const std::string path = kFolder / "keyframes", copy = kFolder / "copy";
  fuzzing::write_file(path, {data, size});
  auto reader = KeyframeFileReader::open(path);
  must(reader.ok() && reader->bytes() == size);
  must(KeyframeFileReader::open(kFolder / "nowhere").reason() == Reason::NO_SUCH_FILE);
  const auto keyframes = read_all(*reader);
  const std::uint64_t end = reader->position();
  must(keyframes.empty() || is_keyframe_file(path));

  reader->rewind();
  std::size_t skipped = 0;
  for (auto head = reader->skip(8); head.ok() && *head; head = reader->skip(8)) {
    must((*head)->size() <= 8);
    ++skipped;
  }
  must(skipped >= keyframes.size() && reader->position() >= end);
  reader->rewind();
  must(read_all(*reader) == keyframes);

  // Only what holds keyframes already is replaced.
  must(KeyframeFileWriter::create(kFolder / "").reason() == Reason::IO_ERROR);
  const bool replaced = size == 0 || is_keyframe_file(path);
  must(KeyframeFileWriter::create(path).ok() == replaced);
  std::filesystem::remove(copy);
  {
    auto writer = KeyframeFileWriter::create(copy);
    must(writer.ok());
    for (const Bytes& keyframe : keyframes) must(writer->write(decode_keyframe(keyframe).or_throw()).ok());
    must(writer->close().ok());
  }
  auto again = KeyframeFileReader::open(copy);
  must(again.ok() && read_all(*again) == keyframes && again->position() == again->bytes());
  return 0;
}
