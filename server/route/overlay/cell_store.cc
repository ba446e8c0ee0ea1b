#include "server/route/overlay/cell_store.h"

#include <algorithm>
#include <atomic>
#include <functional>
#include <list>
#include <optional>
#include <span>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/base/mutex.h"
#include "server/route/overlay/extents.h"
#include "storage/io/file.h"
#include "storage/io/random_file.h"

namespace relmap::route {
namespace {

constexpr std::uint64_t kCrcBytes = 4;
constexpr std::uint64_t kLinkBytes = 44;
constexpr std::size_t kFlushBytes = std::size_t{1} << 18;  // bytes of a cell that are written at once

enum LinkFlags : std::uint32_t { kLoopFlag = 1, kForwardFlag = 2, kOutFlag = 4, kInFlag = 8 };

void put_sealed(ByteWriter& w, const auto& put) {
  const std::size_t begin = w.size();
  w.put(std::uint32_t{0});
  put();
  w.patch(begin, crc32c(ByteSpan(w.bytes()).subspan(begin + kCrcBytes)));
}

void put_frames(ByteWriter& w, const CellFrames& frames) {
  for (const FrameId frame : frames.nodes) {
    w.put(frame.session);
    w.put(frame.index);
  }
  w.put_array(frames.begin.data(), frames.begin.size());
  for (const Link& link : frames.links) {
    w.put(link.to.session);
    w.put(link.to.index);
    w.put(link.metres);
    w.put(link.variance_m2);
    w.put(link.driven_s);
    w.put(link.standing_s);
    w.put(link.ordinal);
    w.put(link.support);
    w.put((link.loop ? kLoopFlag : 0u) | (link.forward ? kForwardFlag : 0u) | (link.out ? kOutFlag : 0u) |
          (link.in ? kInFlag : 0u));
  }
}

FrameId get_frame(ByteReader& r) {
  const auto session = r.get<SessionNumber>();
  return {session, r.get<std::uint32_t>()};
}

// nullopt if the bytes are no frames of a cell, though their checksum is right.
std::optional<CellFrames> get_frames(ByteSpan bytes, std::uint32_t nodes, std::uint32_t links) {
  ByteReader r(bytes);
  CellFrames frames;
  frames.nodes.resize(nodes);
  for (FrameId& frame : frames.nodes) frame = get_frame(r);
  frames.begin.resize(nodes + std::size_t{1});
  r.get_array(frames.begin.data(), frames.begin.size());
  frames.links.resize(links);
  for (Link& link : frames.links) {
    link.to = get_frame(r);
    link.metres = r.get<double>();
    link.variance_m2 = r.get<double>();
    link.driven_s = r.get<float>();
    link.standing_s = r.get<float>();
    link.ordinal = r.get<std::uint32_t>();
    link.support = r.get<std::uint32_t>();
    const auto flags = r.get<std::uint32_t>();
    link.loop = flags & kLoopFlag;
    link.forward = flags & kForwardFlag;
    link.out = flags & kOutFlag;
    link.in = flags & kInFlag;
  }
  const bool costs = std::ranges::none_of(frames.links, [](const Link& link) {
    return link.metres < 0 || link.variance_m2 < 0 || link.driven_s < 0 || link.standing_s < 0;
  });
  const bool whole =
      costs && frames.begin.front() == 0 && frames.begin.back() == links &&
      std::is_sorted(frames.begin.begin(), frames.begin.end()) &&
      std::adjacent_find(frames.nodes.begin(), frames.nodes.end(), std::greater_equal<>()) == frames.nodes.end();
  if (!whole) return std::nullopt;
  return frames;
}

void put_matrix(ByteWriter& w, const SplitCostMatrix& matrix) {
  w.reserve(w.size() + matrix.bytes().size());
  w.put_bytes(matrix.bytes());
}

}  // namespace

struct CellStore::Impl {
  Impl(std::unique_ptr<storage::RandomFile> f, std::string d, std::shared_ptr<storage::Budget> b, std::uint64_t room)
      : file(std::move(f)), folder(std::move(d)), budget(std::move(b)), room_for_others(room) {}

  // A part of a cell in memory, charged to the budget as long as anybody holds it.
  template <typename T>
  struct Held {
    Held(T v, std::shared_ptr<storage::Budget> b, std::size_t n)
        : value(std::move(v)), budget(std::move(b)), bytes(n) {}
    ~Held() { budget->release(storage::Share::kRoutes, bytes); }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    const T value;
    const std::shared_ptr<storage::Budget> budget;
    const std::size_t bytes;
  };
  struct Kept {
    std::uint64_t offset;
    std::shared_ptr<const void> part;
    std::size_t bytes;
  };

  // The part at `offset`, from memory or else from the disk.
  template <typename Load>
  auto part(std::uint64_t offset, std::size_t bytes, const Load& load)
      -> std::shared_ptr<const std::invoke_result_t<Load>>;
  template <typename T>
  void keep(std::uint64_t offset, T value, std::size_t bytes);
  bool is_kept(std::uint64_t offset) {
    const MutexLock lock(mutex);
    return places.contains(offset);
  }
  CellFrames load_frames(std::uint64_t offset, std::uint32_t nodes, std::uint32_t links);
  SplitCostMatrix load_matrix(std::uint64_t offset, std::uint32_t nodes);
  void read(std::uint64_t offset, std::span<std::uint8_t> bytes);
  void read_sealed(std::uint64_t offset, std::span<std::uint8_t> bytes);
  [[noreturn]] void throw_damaged();
  void charge(std::size_t bytes);
  std::size_t evict(std::size_t bytes);
  void drop(std::uint64_t offset) RELMAP_REQUIRES(mutex);
  Status look_for_room(std::uint64_t bytes) const;

  const std::unique_ptr<storage::RandomFile> file;
  const std::string folder;  // empty: the size of the file is not limited
  const std::shared_ptr<storage::Budget> budget;
  const std::uint64_t room_for_others;
  std::atomic<bool> damaged = false;

  Mutex mutex;
  std::list<Kept> kept RELMAP_GUARDED_BY(mutex);  // most recently used first
  std::unordered_map<std::uint64_t, std::list<Kept>::iterator> places RELMAP_GUARDED_BY(mutex);
  Extents extents RELMAP_GUARDED_BY(mutex);
  std::uint64_t file_end RELMAP_GUARDED_BY(mutex) = 0;
};

template <typename Load>
auto CellStore::Impl::part(std::uint64_t offset, std::size_t bytes, const Load& load)
    -> std::shared_ptr<const std::invoke_result_t<Load>> {
  using T = std::invoke_result_t<Load>;
  {
    const MutexLock lock(mutex);
    if (const auto at = places.find(offset); at != places.end()) {
      kept.splice(kept.begin(), kept, at->second);
      return std::static_pointer_cast<const T>(at->second->part);
    }
  }
  charge(bytes);
  std::shared_ptr<const T> made;
  try {
    const auto held = std::make_shared<const Held<T>>(load(), budget, bytes);
    made = std::shared_ptr<const T>(held, &held->value);
  } catch (...) {
    budget->release(storage::Share::kRoutes, bytes);
    throw;
  }
  const MutexLock lock(mutex);
  if (places.contains(offset)) return made;
  kept.push_front({offset, made, bytes});
  places.emplace(offset, kept.begin());
  return made;
}

// Caches what was just written if there is room.
template <typename T>
void CellStore::Impl::keep(std::uint64_t offset, T value, std::size_t bytes) {
  if (!budget->try_charge(storage::Share::kRoutes, bytes)) return;
  const auto held = std::make_shared<const Held<T>>(std::move(value), budget, bytes);
  const MutexLock lock(mutex);
  kept.push_front({offset, std::shared_ptr<const T>(held, &held->value), bytes});
  places.emplace(offset, kept.begin());
}

CellFrames CellStore::Impl::load_frames(std::uint64_t offset, std::uint32_t nodes, std::uint32_t links) {
  Bytes bytes(nodes * std::size_t{12} + 4 + links * kLinkBytes);
  read_sealed(offset, bytes);
  auto frames = get_frames(bytes, nodes, links);
  if (!frames) throw_damaged();
  return *std::move(frames);
}

SplitCostMatrix CellStore::Impl::load_matrix(std::uint64_t offset, std::uint32_t nodes) {
  SplitCostMatrix matrix(nodes);
  read_sealed(offset, matrix.bytes());
  if (!matrix.valid()) throw_damaged();
  return matrix;
}

void CellStore::Impl::read(std::uint64_t offset, std::span<std::uint8_t> bytes) {
  const Status status = file->read(offset, bytes.data(), bytes.size());
  if (status.ok()) return;
  damaged = true;
  throw StatusError(status.reason() == Reason::TRUNCATED ? Status(Reason::DATA_LOSS, status.message()) : status);
}

void CellStore::Impl::read_sealed(std::uint64_t offset, std::span<std::uint8_t> bytes) {
  std::uint32_t crc = 0;
  read(offset, {reinterpret_cast<std::uint8_t*>(&crc), kCrcBytes});
  read(offset + kCrcBytes, bytes);
  if (crc != crc32c(bytes)) throw_damaged();
}

void CellStore::Impl::throw_damaged() {
  damaged = true;
  throw StatusError(
      Status(Reason::DATA_LOSS, "the cells in " + file->path() + " are damaged; they are made again from the map"));
}

void CellStore::Impl::charge(std::size_t bytes) {
  while (!budget->try_charge(storage::Share::kRoutes, bytes))
    if (evict(bytes) == 0)
      throw StatusError(
          Status(Reason::BUDGET_EXCEEDED, "the cells that this search passes need more than the " +
                                              std::to_string(budget->allowance(storage::Share::kRoutes) >> 20) +
                                              " MB that memory_budget_mb leaves for them"));
}

std::size_t CellStore::Impl::evict(std::size_t bytes) {
  std::vector<std::shared_ptr<const void>> gone;  // freed after the lock is released
  std::size_t freed = 0;
  const MutexLock lock(mutex);
  for (auto at = kept.end(); freed < bytes && at != kept.begin();) {
    --at;
    if (at->part.use_count() > 1) continue;  // its memory would not be freed
    freed += at->bytes;
    gone.push_back(std::move(at->part));
    places.erase(at->offset);
    at = kept.erase(at);
  }
  return freed;
}

void CellStore::Impl::drop(std::uint64_t offset) {
  const auto at = places.find(offset);
  if (at == places.end()) return;
  kept.erase(at->second);
  places.erase(at);
}

Status CellStore::Impl::look_for_room(std::uint64_t bytes) const {
  if (folder.empty()) return {};
  const auto room = storage::posix_file_system()->room(folder);
  if (!room.ok()) return room.status();
  if (room->free < room_for_others + bytes)
    return {Reason::DISK_FULL, "the disk has no room for cells of routes beside what is reserved for the map"};
  return {};
}

CellStore::CellStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CellStore::~CellStore() = default;

Result<std::shared_ptr<CellStore>> CellStore::open(const std::string& data_folder,
                                                   std::shared_ptr<storage::Budget> budget,
                                                   std::uint64_t room_for_others) {
  const std::string folder = data_folder + "/routes";
  if (Status made = storage::posix_file_system()->create_directory(folder); !made.ok()) return made;
  const std::string path = folder + "/cells";
  // The file is replaced, not emptied, since searches may still read the earlier one.
  if (Status gone = storage::posix_file_system()->remove(path); !gone.ok() && gone.reason() != Reason::NO_SUCH_FILE)
    return gone;
  return open_file(folder, std::move(budget), room_for_others);
}

Result<std::shared_ptr<CellStore>> CellStore::reopen(const std::string& data_folder,
                                                     std::shared_ptr<storage::Budget> budget,
                                                     std::uint64_t room_for_others) {
  return open_file(data_folder + "/routes", std::move(budget), room_for_others);
}

Result<std::shared_ptr<CellStore>> CellStore::open_file(const std::string& folder,
                                                        std::shared_ptr<storage::Budget> budget,
                                                        std::uint64_t room_for_others) {
  auto file = storage::RandomFile::open(folder + "/cells");
  if (!file.ok()) return file.status();
  const auto size = (*file)->size();
  if (!size.ok()) return size.status();
  std::shared_ptr<CellStore> store(
      new CellStore(std::make_unique<Impl>(std::move(file).value(), folder, std::move(budget), room_for_others)));
  const MutexLock lock(store->impl_->mutex);
  store->impl_->file_end = *size;
  return store;
}

Result<std::shared_ptr<CellStore>> CellStore::open_temporary(std::shared_ptr<storage::Budget> budget) {
  auto file = storage::RandomFile::open_temporary();
  if (!file.ok()) return file.status();
  if (!budget) budget = std::make_shared<storage::Budget>(std::numeric_limits<std::size_t>::max() / 4);
  return std::shared_ptr<CellStore>(
      new CellStore(std::make_unique<Impl>(std::move(file).value(), "", std::move(budget), 0)));
}

std::shared_ptr<const StoredCell> CellStore::write(const Cell& cell, std::shared_ptr<const StoredCell> known) {
  return write(
      cell.facts, cell.frames, cell.within.size(), [&](std::size_t metric) { return cell.within[metric]; },
      std::move(known));
}

std::shared_ptr<const StoredCell> CellStore::write(const CellFacts& facts, const CellFrames& frames,
                                                   std::size_t metrics, const Within& within,
                                                   std::shared_ptr<const StoredCell> known) {
  std::shared_ptr<StoredCell> stored(new StoredCell(shared_from_this(), facts));
  stored->nodes_ = static_cast<std::uint32_t>(frames.nodes.size());
  stored->links_ = static_cast<std::uint32_t>(frames.links.size());
  stored->metrics_ = static_cast<std::uint32_t>(metrics);
  const std::uint64_t bytes = stored->matrix_offset(metrics, false);
  std::uint64_t grown = 0;
  {
    const MutexLock lock(impl_->mutex);
    stored->offset_ = impl_->extents.take(bytes);
    stored->bytes_ = bytes;
    if (const std::uint64_t end = impl_->extents.end(); end > impl_->file_end) grown = end - impl_->file_end;
  }
  if (grown > 0)
    if (Status status = impl_->look_for_room(grown); !status.ok()) throw StatusError(status);

  bool same = known && known->facts_ == facts && known->nodes_ == stored->nodes_ && known->links_ == stored->links_;
  ByteWriter w;
  std::uint64_t written = 0;
  const auto flush = [&](std::size_t min_bytes) {
    if (w.size() < min_bytes) return;
    if (same) {
      Bytes before(w.size());
      impl_->read(known->offset_ + written, before);
      same = before == w.bytes();
    }
    if (Status status = impl_->file->write(stored->offset_ + written, w.bytes()); !status.ok())
      throw StatusError(status);
    written += w.size();
    w = {};
  };
  // Caches the same parts of this cell as searches have in memory of the earlier one.
  std::vector<std::pair<std::uint64_t, SplitCostMatrix>> wanted;
  const auto put = [&](SplitCostMatrix matrix, std::size_t metric, bool backward) {
    flush(kFlushBytes);
    put_sealed(w, [&] { put_matrix(w, matrix); });
    if (known && impl_->is_kept(known->offset_ + known->matrix_offset(metric, backward)))
      wanted.emplace_back(stored->offset_ + stored->matrix_offset(metric, backward), std::move(matrix));
  };
  put_sealed(w, [&] { put_frames(w, frames); });
  for (std::size_t metric = 0; metric < metrics; ++metric) {
    const CostMatrix matrix = within(metric);
    put(SplitCostMatrix(matrix), metric, false);
    if (facts.oneway) put(SplitCostMatrix(matrix.transposed()), metric, true);
  }
  flush(0);
  if (same) return known;
  if (known && impl_->is_kept(known->offset_)) impl_->keep(stored->offset_, frames, stored->frames_memory());
  for (auto& [offset, matrix] : wanted) impl_->keep(offset, std::move(matrix), stored->matrix_memory());
  const MutexLock lock(impl_->mutex);
  impl_->file_end = std::max(impl_->file_end, stored->offset_ + stored->bytes_);
  return stored;
}

void CellStore::put(ByteWriter& w, const StoredCell& cell) const {
  w.put(cell.offset_);
  w.put(cell.bytes_);
  w.put(cell.nodes_);
  w.put(cell.links_);
  w.put(cell.metrics_);
  w.put(cell.facts_.oneway);
  w.put(cell.facts_.joined);
  w.put(cell.facts_.min_support);
  w.put(cell.facts_.max_loop_m);
}

std::shared_ptr<const StoredCell> CellStore::get(ByteReader& r) {
  std::shared_ptr<StoredCell> cell(new StoredCell(shared_from_this(), {}));
  const auto offset = r.get<std::uint64_t>(), bytes = r.get<std::uint64_t>();
  cell->nodes_ = r.get<std::uint32_t>();
  cell->links_ = r.get<std::uint32_t>();
  cell->metrics_ = r.get<std::uint32_t>();
  cell->facts_.oneway = r.get<std::uint8_t>() != 0;
  cell->facts_.joined = r.get<std::uint8_t>() != 0;
  cell->facts_.min_support = r.get<std::uint32_t>();
  cell->facts_.max_loop_m = r.get<double>();
  const MutexLock lock(impl_->mutex);
  if (!r.ok() || bytes == 0 || bytes > impl_->file_end || offset > impl_->file_end - bytes ||
      cell->nodes_ > (1u << 20) || cell->metrics_ > 1000 || bytes != cell->matrix_offset(cell->metrics_, false) ||
      !impl_->extents.is_free(offset, bytes))
    return nullptr;
  impl_->extents.retake(offset, bytes);
  cell->offset_ = offset;
  cell->bytes_ = bytes;
  return cell;
}

Status CellStore::sync() { return impl_->file->sync(); }

std::size_t CellStore::evict(std::size_t bytes) { return impl_->evict(bytes); }

void CellStore::trim() {
  const MutexLock lock(impl_->mutex);
  if (impl_->extents.end() >= impl_->file_end || !impl_->file->truncate(impl_->extents.end()).ok()) return;
  impl_->file_end = impl_->extents.end();
}

bool CellStore::is_damaged() const { return impl_->damaged; }

std::uint64_t CellStore::bytes_in_use() const {
  const MutexLock lock(impl_->mutex);
  return impl_->extents.in_use();
}

StoredCell::~StoredCell() {
  if (bytes_ == 0) return;
  CellStore::Impl& store = *store_->impl_;
  const MutexLock lock(store.mutex);
  std::uint64_t offset = offset_;
  store.drop(offset);
  offset += frames_bytes();
  for (std::uint32_t m = 0; m < (facts_.oneway ? 2 : 1) * metrics_; ++m, offset += matrix_bytes()) store.drop(offset);
  store.extents.give_back(offset_, bytes_);
}

std::uint64_t StoredCell::frames_bytes() const {
  return kCrcBytes + std::uint64_t{nodes_} * 12 + 4 + links_ * kLinkBytes;
}
std::uint64_t StoredCell::matrix_bytes() const { return kCrcBytes + SplitCostMatrix::memory_bytes(nodes_); }

std::uint64_t StoredCell::matrix_offset(std::size_t metric, bool backward) const {
  const std::uint64_t before = facts_.oneway ? 2 * metric + backward : metric;
  return frames_bytes() + before * matrix_bytes();
}

std::size_t StoredCell::frames_memory() const {
  return sizeof(CellFrames) + 160 + nodes_ * std::size_t{12} + 4 + links_ * sizeof(Link);
}
std::size_t StoredCell::matrix_memory() const {
  return sizeof(SplitCostMatrix) + 160 + SplitCostMatrix::memory_bytes(nodes_);
}

std::shared_ptr<const CellFrames> StoredCell::frames() const {
  return store_->impl_->part(offset_, frames_memory(),
                             [&] { return store_->impl_->load_frames(offset_, nodes_, links_); });
}

std::shared_ptr<const SplitCostMatrix> StoredCell::within(std::size_t metric, bool backward) const {
  const std::uint64_t offset = offset_ + matrix_offset(metric, backward);
  return store_->impl_->part(offset, matrix_memory(), [&] { return store_->impl_->load_matrix(offset, nodes_); });
}

CellFrames StoredCell::read_frames() const { return store_->impl_->load_frames(offset_, nodes_, links_); }

CostMatrix StoredCell::read_within(std::size_t metric) const {
  return store_->impl_->load_matrix(offset_ + matrix_offset(metric, false), nodes_).whole();
}

}  // namespace relmap::route
