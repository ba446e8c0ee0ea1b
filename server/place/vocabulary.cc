#include "server/place/vocabulary.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "server/place/vocabulary_format.h"
#include "server/place/word_search.h"

namespace relmap::place {
namespace {

// The bytes into which the tables point, owned or mapped.
class Storage {
 public:
  explicit Storage(Bytes bytes) : owned_(std::move(bytes)) { bytes_ = owned_; }
  Storage(void* address, std::size_t size)
      : mapped_(address), bytes_(static_cast<const std::uint8_t*>(address), size) {}
  ~Storage() {
    if (mapped_) munmap(mapped_, bytes_.size());
  }
  Storage(const Storage&) = delete;
  Storage& operator=(const Storage&) = delete;

  ByteSpan bytes() const { return bytes_; }

 private:
  Bytes owned_;
  void* mapped_ = nullptr;
  ByteSpan bytes_;
};

class FileVocabulary final : public Vocabulary {
 public:
  FileVocabulary(std::unique_ptr<Storage> storage, const VocabularyTables& tables)
      : storage_(std::move(storage)),
        tables_(tables),
        search_(tables.branches, tables.branch_begin, tables.centroids) {}

  std::uint32_t size() const override { return static_cast<std::uint32_t>(tables_.centroids.size()); }
  std::uint32_t crc() const override { return tables_.crc; }
  std::string source() const override { return std::string(tables_.source); }

  std::vector<std::uint32_t> words(std::span<const AppearanceFeature> features) const override {
    std::vector<std::uint32_t> result;
    result.reserve(features.size());
    for (const AppearanceFeature& feature : features) result.push_back(search_.nearest(feature.descriptor));
    return result;
  }

  const Descriptor& centroid(std::uint32_t word) const override { return tables_.centroids[word]; }
  std::span<const float> marginal() const override { return tables_.marginal; }
  std::span<const std::uint32_t> parent() const override { return tables_.parent; }
  std::span<const float> given_parent_absent() const override { return tables_.given_parent_absent; }
  std::span<const float> given_parent_present() const override { return tables_.given_parent_present; }

  std::size_t sample_places() const override { return tables_.sample_begin.size() - 1; }
  std::span<const std::uint32_t> sample_place(std::size_t i) const override {
    const std::uint32_t begin = tables_.sample_begin[i];
    return tables_.sample_words.subspan(begin, tables_.sample_begin[i + 1] - begin);
  }

 private:
  std::unique_ptr<Storage> storage_;
  VocabularyTables tables_;
  WordSearch search_;
};

Result<std::shared_ptr<const Vocabulary>> open_storage(std::unique_ptr<Storage> storage) {
  const Result<VocabularyTables> tables = parse_vocabulary(storage->bytes());
  if (!tables.ok()) return tables.status();
  return std::shared_ptr<const Vocabulary>(std::make_shared<FileVocabulary>(std::move(storage), *tables));
}

std::string system_message(const std::string& path) { return path + ": " + std::generic_category().message(errno); }

}  // namespace

Result<std::shared_ptr<const Vocabulary>> Vocabulary::load(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return Status(Reason::NO_SUCH_FILE, system_message(path));
  struct stat info {};
  void* address = MAP_FAILED;
  const bool regular = fstat(file, &info) == 0 && S_ISREG(info.st_mode);
  if (regular && info.st_size > 0)
    address = mmap(nullptr, static_cast<std::size_t>(info.st_size), PROT_READ, MAP_PRIVATE, file, 0);
  const Status failure = !regular                ? Status(Reason::NO_SUCH_FILE, path + ": not a regular file")
                         : info.st_size == 0     ? Status(Reason::CORRUPT, path + ": empty")
                         : address == MAP_FAILED ? Status(Reason::NO_SUCH_FILE, system_message(path))
                                                 : Status();
  close(file);
  if (!failure.ok()) return failure;
  auto vocabulary = open_storage(std::make_unique<Storage>(address, static_cast<std::size_t>(info.st_size)));
  if (!vocabulary.ok()) return Status(vocabulary.reason(), path + ": " + vocabulary.status().message());
  return vocabulary;
}

Result<std::shared_ptr<const Vocabulary>> Vocabulary::from_bytes(Bytes bytes) {
  return open_storage(std::make_unique<Storage>(std::move(bytes)));
}

std::string default_vocabulary_path() {
  std::string executable(4096, '\0');
  const ssize_t length = readlink("/proc/self/exe", executable.data(), executable.size());
  executable.resize(length > 0 ? static_cast<std::size_t>(length) : 0);
  const std::size_t slash = executable.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : executable.substr(0, slash);
  return folder + "/../share/relmap/default.vocab";
}

}  // namespace relmap::place
