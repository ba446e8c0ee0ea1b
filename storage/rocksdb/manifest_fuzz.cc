// Any bytes as RocksDB's list of files: they are read as records that can be written and read again, and blob files
// can be added to them. The first byte says how many; what describes them is taken from the end.
#include "proto/base/testing/fuzzing.h"
#include "storage/rocksdb/manifest_log.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using namespace relmap::storage;
  using fuzzing::must;
  if (size == 0) return 0;
  const ByteSpan log(data + 1, size - 1);
  const std::vector<Bytes> records = read_log(log);
  std::size_t bytes = 0;
  ByteWriter w;
  for (const Bytes& record : records) {
    bytes += record.size();
    put_log_record(w, record);
  }
  must(bytes <= log.size() && read_log(w.bytes()) == records);
  must(length_without_torn_end(log) <= log.size());
  must(length_without_torn_end(w.bytes()) == w.size());

  std::vector<BlobFile> blobs;
  for (std::size_t i = 0; i < data[0] % 4u; ++i) {
    const ByteSpan described = log.last(std::min<std::size_t>(log.size(), kBlobHeader + kBlobFooter + i));
    const std::string stem(described.begin(), described.begin() + static_cast<std::ptrdiff_t>(described.size() / 8));
    const ByteSpan header = described.first(described.size() / 2), footer = described.subspan(described.size() / 2);
    for (const std::string& name : {stem, "00000" + std::to_string(i)})
      if (const auto blob = blob_file(name, described.size(), header, footer)) blobs.push_back(*blob);
  }
  must(read_log(with_blob_files(log, blobs)).size() == records.size() + blobs.size());
  return 0;
}
