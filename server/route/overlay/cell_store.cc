#include "server/route/overlay/cell_store.h"

#include <algorithm>
#include <atomic>
#include <list>
#include <mutex>
#include <unordered_map>
#include <utility>

#include "proto/crc32c.h"
#include "server/route/overlay/extents.h"
#include "storage/file.h"
#include "storage/random_file.h"

namespace relmap {
namespace {

constexpr std::uint64_t kCrcBytes = 4;
constexpr std::uint64_t kLinkBytes = 44;
// Less free room than this, or an eighth of the disk, is the map's: cells grow no more.
constexpr std::uint64_t kRoomForMap = std::uint64_t{512} << 20;

enum LinkFlags : std::uint32_t { kLoop = 1, kForward = 2, kOut = 4, kIn = 8 };

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
    w.put((link.loop ? kLoop : 0u) | (link.forward ? kForward : 0u) | (link.out ? kOut : 0u) | (link.in ? kIn : 0u));
  }
}

FrameId get_frame(ByteReader& r) {
  const auto session = r.get<SessionNumber>();
  return {session, r.get<std::uint32_t>()};
}

CellFrames get_frames(ByteSpan bytes, std::uint32_t nodes, std::uint32_t links) {
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
    link.loop = flags & kLoop;
    link.forward = flags & kForward;
    link.out = flags & kOut;
    link.in = flags & kIn;
  }
  return frames;
}

void put_matrix(ByteWriter& w, const CostMatrix& whole) {
  const SplitCostMatrix matrix(whole);
  const std::size_t entries = matrix.size() * matrix.size();
  w.put_array(matrix.floors(0), entries);
  w.put_array(matrix.rests(0), entries);
}

SplitCostMatrix get_matrix(ByteSpan bytes, std::uint32_t nodes) {
  SplitCostMatrix matrix(nodes);
  const std::size_t entries = std::size_t{nodes} * nodes;
  ByteReader r(bytes);
  r.get_array(matrix.floors(0), entries);
  r.get_array(matrix.rests(0), entries);
  return matrix;
}

Bytes encode(const Cell& cell) {
  ByteWriter w;
  put_sealed(w, [&] { put_frames(w, cell.frames); });
  for (const CostMatrix& matrix : cell.within) put_sealed(w, [&] { put_matrix(w, matrix); });
  if (cell.facts.oneway)
    for (const CostMatrix& matrix : cell.within) put_sealed(w, [&] { put_matrix(w, matrix.transposed()); });
  return w.take();
}

}  // namespace

struct CellStore::Impl {
  Impl(std::unique_ptr<RandomFile> f, std::string d, std::shared_ptr<Budget> b)
      : file(std::move(f)), folder(std::move(d)), budget(std::move(b)) {}

  // A part of a cell in memory, charged for as long as anybody holds it.
  template <typename T>
  struct Held {
    Held(T v, std::shared_ptr<Budget> b, std::size_t n) : value(std::move(v)), budget(std::move(b)), bytes(n) {}
    ~Held() { budget->release(Share::kRoutes, bytes); }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    const T value;
    const std::shared_ptr<Budget> budget;
    const std::size_t bytes;
  };
  struct Kept {
    std::uint64_t offset;
    std::shared_ptr<const void> part;
    std::size_t bytes;
  };

  // What stands at `offset`, of memory or else of the disk.
  template <typename T, typename Decode>
  std::shared_ptr<const T> part(std::uint64_t offset, std::uint64_t size, std::size_t bytes, const Decode& decode);
  Bytes read(std::uint64_t offset, std::uint64_t size);
  ByteSpan unseal(ByteSpan sealed);
  void charge(std::size_t bytes);
  std::shared_ptr<const void> drop_oldest(std::size_t* bytes);
  void drop(std::uint64_t offset);
  std::uint64_t take(std::uint64_t bytes);

  const std::unique_ptr<RandomFile> file;
  const std::string folder;  // empty: nobody minds how large the file is
  const std::shared_ptr<Budget> budget;
  std::atomic<bool> damaged = false;

  std::mutex mutex;
  std::list<Kept> kept;  // asked for last: first
  std::unordered_map<std::uint64_t, std::list<Kept>::iterator> places;
  Extents extents;
  std::uint64_t file_end = 0;
};

template <typename T, typename Decode>
std::shared_ptr<const T> CellStore::Impl::part(std::uint64_t offset, std::uint64_t size, std::size_t bytes,
                                               const Decode& decode) {
  {
    const std::lock_guard lock(mutex);
    if (const auto at = places.find(offset); at != places.end()) {
      kept.splice(kept.begin(), kept, at->second);
      return std::static_pointer_cast<const T>(at->second->part);
    }
  }
  charge(bytes);
  std::shared_ptr<const T> made;
  try {
    const Bytes sealed = read(offset, size);
    const auto held = std::make_shared<const Held<T>>(decode(unseal(sealed)), budget, bytes);
    made = std::shared_ptr<const T>(held, &held->value);
  } catch (...) {
    budget->release(Share::kRoutes, bytes);
    throw;
  }
  const std::lock_guard lock(mutex);
  const auto [at, fresh] = places.try_emplace(offset);
  if (fresh) at->second = kept.insert(kept.begin(), {offset, made, bytes});
  return made;
}

Bytes CellStore::Impl::read(std::uint64_t offset, std::uint64_t size) {
  Bytes bytes(size);
  if (Status status = file->read(offset, bytes.data(), bytes.size()); !status.ok()) {
    damaged = true;
    throw StatusError(status);
  }
  return bytes;
}

ByteSpan CellStore::Impl::unseal(ByteSpan sealed) {
  const ByteSpan bytes = sealed.subspan(kCrcBytes);
  if (ByteReader(sealed).get<std::uint32_t>() != crc32c(bytes)) {
    damaged = true;
    throw StatusError(
        Status(Reason::DATA_LOSS, "the cells in " + file->path() + " are damaged; they are made again from the map"));
  }
  return bytes;
}

void CellStore::Impl::charge(std::size_t bytes) {
  while (!budget->try_charge(Share::kRoutes, bytes)) {
    std::shared_ptr<const void> gone;
    {
      const std::lock_guard lock(mutex);
      gone = drop_oldest(nullptr);
    }
    if (!gone)
      throw StatusError(Status(Reason::BUDGET_EXCEEDED, "cells that this search passes find no room in the " +
                                                            std::to_string(budget->allowance(Share::kRoutes) >> 20) +
                                                            " MB that memory_budget_mb leaves for them"));
  }
}

std::shared_ptr<const void> CellStore::Impl::drop_oldest(std::size_t* bytes) {
  if (kept.empty()) return nullptr;
  std::shared_ptr<const void> part = std::move(kept.back().part);
  if (bytes) *bytes += kept.back().bytes;
  places.erase(kept.back().offset);
  kept.pop_back();
  return part;
}

void CellStore::Impl::drop(std::uint64_t offset) {
  const auto at = places.find(offset);
  if (at == places.end()) return;
  kept.erase(at->second);
  places.erase(at);
}

std::uint64_t CellStore::Impl::take(std::uint64_t bytes) {
  const std::lock_guard lock(mutex);
  const std::uint64_t offset = extents.take(bytes);
  if (extents.end() <= file_end) return offset;
  if (!folder.empty()) {
    const auto room = posix_file_system()->room(folder);
    const Status enough = !room.ok() ? room.status()
                          : room->free < std::min(kRoomForMap, room->size / 8) + (extents.end() - file_end)
                              ? Status(Reason::DISK_FULL, "what is free on the disk is left to the map")
                              : Status();
    if (!enough.ok()) {
      extents.give_back(offset, bytes);
      throw StatusError(enough);
    }
  }
  file_end = extents.end();
  return offset;
}

CellStore::CellStore(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CellStore::~CellStore() = default;

Result<std::shared_ptr<CellStore>> CellStore::open(const std::string& data_folder, std::shared_ptr<Budget> budget) {
  const std::string folder = data_folder + "/routes";
  if (Status made = posix_file_system()->create_directory(folder); !made.ok()) return made;
  const std::string path = folder + "/cells";
  // Another file: searches may still read the one that was there.
  if (Status gone = posix_file_system()->remove(path); !gone.ok() && gone.reason() != Reason::NO_SUCH_FILE) return gone;
  auto file = RandomFile::open(path);
  if (!file.ok()) return file.status();
  return std::shared_ptr<CellStore>(
      new CellStore(std::make_unique<Impl>(std::move(file).value(), folder, std::move(budget))));
}

Result<std::shared_ptr<CellStore>> CellStore::open_temporary(std::shared_ptr<Budget> budget) {
  auto file = RandomFile::open_temporary();
  if (!file.ok()) return file.status();
  if (!budget) budget = std::make_shared<Budget>(std::numeric_limits<std::size_t>::max() / 4);
  return std::shared_ptr<CellStore>(
      new CellStore(std::make_unique<Impl>(std::move(file).value(), "", std::move(budget))));
}

std::shared_ptr<const StoredCell> CellStore::write(const Cell& cell) {
  std::shared_ptr<StoredCell> stored(new StoredCell(shared_from_this(), cell.facts));
  stored->nodes_ = static_cast<std::uint32_t>(cell.frames.nodes.size());
  stored->links_ = static_cast<std::uint32_t>(cell.frames.links.size());
  stored->metrics_ = static_cast<std::uint32_t>(cell.within.size());
  const Bytes bytes = encode(cell);
  stored->offset_ = impl_->take(bytes.size());
  stored->bytes_ = bytes.size();
  if (Status status = impl_->file->write(stored->offset_, bytes); !status.ok()) throw StatusError(status);
  return stored;
}

void CellStore::evict(std::size_t bytes) {
  std::vector<std::shared_ptr<const void>> gone;  // freed where nothing is locked
  const std::lock_guard lock(impl_->mutex);
  for (std::size_t dropped = 0; dropped < bytes && !impl_->kept.empty();) gone.push_back(impl_->drop_oldest(&dropped));
}

bool CellStore::is_damaged() const { return impl_->damaged; }

std::uint64_t CellStore::disk_bytes() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->extents.in_use();
}

StoredCell::~StoredCell() {
  if (bytes_ == 0) return;
  CellStore::Impl& store = *store_->impl_;
  const std::lock_guard lock(store.mutex);
  std::uint64_t offset = offset_;
  store.drop(offset);
  offset += frames_bytes();
  for (std::uint32_t m = 0; m < (facts_.oneway ? 2 : 1) * metrics_; ++m, offset += matrix_bytes()) store.drop(offset);
  store.extents.give_back(offset_, bytes_);
}

std::uint64_t StoredCell::frames_bytes() const {
  return kCrcBytes + std::uint64_t{nodes_} * 12 + 4 + links_ * kLinkBytes;
}
std::uint64_t StoredCell::matrix_bytes() const {
  return kCrcBytes + std::uint64_t{nodes_} * nodes_ * 2 * sizeof(float);
}

std::shared_ptr<const CellFrames> StoredCell::frames() const {
  const std::size_t bytes = sizeof(CellFrames) + 160 + nodes_ * std::size_t{12} + 4 + links_ * sizeof(Link);
  return store_->impl_->part<CellFrames>(offset_, frames_bytes(), bytes,
                                         [&](ByteSpan span) { return get_frames(span, nodes_, links_); });
}

std::shared_ptr<const SplitCostMatrix> StoredCell::within(std::size_t metric, bool backward) const {
  const std::uint64_t number = metric + (backward && facts_.oneway ? metrics_ : 0);
  const std::size_t bytes = sizeof(SplitCostMatrix) + 160 + std::size_t{nodes_} * nodes_ * 2 * sizeof(float);
  return store_->impl_->part<SplitCostMatrix>(offset_ + frames_bytes() + number * matrix_bytes(), matrix_bytes(), bytes,
                                              [&](ByteSpan span) { return get_matrix(span, nodes_); });
}

Cell StoredCell::read() const {
  CellStore::Impl& store = *store_->impl_;
  const Bytes all = store.read(offset_, frames_bytes() + metrics_ * matrix_bytes());
  const ByteSpan bytes(all);
  Cell cell;
  cell.facts = facts_;
  cell.frames = get_frames(store.unseal(bytes.first(frames_bytes())), nodes_, links_);
  for (std::uint32_t m = 0; m < metrics_; ++m)
    cell.within.push_back(
        get_matrix(store.unseal(bytes.subspan(frames_bytes() + m * matrix_bytes(), matrix_bytes())), nodes_).whole());
  return cell;
}

bool StoredCell::is(const Cell& other) const {
  if (!(facts_ == other.facts) || nodes_ != other.frames.nodes.size() || links_ != other.frames.links.size())
    return false;
  return store_->impl_->read(offset_, bytes_) == encode(other);
}

}  // namespace relmap
