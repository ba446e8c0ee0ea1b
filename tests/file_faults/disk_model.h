// A disk on which the operations of a trace are done one after the other, and what a failure of the power can leave of
// it at any moment. Nothing but a sync makes anything durable: that of a file its bytes and length, that of a folder
// the names in it. Of what is not durable any part may be there:
//   - of a file every sector of 512 bytes as it was at some moment since the last sync, and the length of some moment,
//     with zeros where nothing was written;
//   - every name in a folder as it was at some moment since the last sync, whatever became of the others. A rename
//     happens wholly or not at all; one between two folders is durable once both are synced, or once something that
//     happened later to one of its two names is: the disk cannot have the later without the earlier.
// A folder whose own name is lost is lost with all that is in it.
//
// As on Linux, a sync of a file that fails has dropped what it was to write, but for a part that reached the disk by
// chance: the next one succeeds without it. Of a folder it drops nothing.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/file_faults/trace.h"

namespace relmap::testing {

enum class Survives {
  kDurable,     // nothing but what is durable
  kEverything,  // all that was done, as after a kill of the program
  kSome         // any part of what is not durable, by chance
};

class DiskModel {
 public:
  // With what is in the folder now, which is durable.
  explicit DiskModel(const std::string& folder);
  // Not copied: what its names stand for would be shared.
  DiskModel(DiskModel&&) = default;
  DiskModel& operator=(DiskModel&&) = delete;

  // Throws std::runtime_error if the operation is impossible on this disk, which it never is if the trace is complete.
  void apply(const FileOperation& operation);

  // Makes the folder, and in it what a power failure after the last operation leaves.
  void lay_out(const std::string& folder, Survives survives, std::uint64_t seed = 0) const;

 private:
  struct Node;
  using NodePointer = std::shared_ptr<Node>;
  using Names = std::map<std::string, NodePointer>;
  struct Content {
    std::string bytes;  // zeros at the end may be left out
    std::uint64_t size = 0;
  };
  // A write, or a change of the length.
  struct Change {
    bool resize = false;
    std::uint64_t offset = 0;
    std::string bytes = {};
  };
  struct Node {
    bool folder = false;
    Content now, durable;
    std::vector<Change> changes;  // since `durable`
    Names names, durable_names;
  };
  struct NewName {
    Node* folder = nullptr;
    std::string name;
    NodePointer node;  // null: the name is gone
  };
  // What happens to names wholly or not at all.
  struct Renaming {
    std::vector<NewName> names;
    std::set<Node*> unsynced;  // the folders whose syncs it waits for
  };

  NodePointer read(const std::string& path, std::map<std::pair<std::uint64_t, std::uint64_t>, NodePointer>& known);
  static void change(Content& content, const Change& change);
  static bool share_a_name(const Renaming& a, const Renaming& b);
  static Content remains(const Node& node, Survives survives, std::mt19937_64& random);

  NodePointer find(const std::string& path) const;  // null: there is none
  NodePointer find_there(const std::string& path) const;
  std::pair<Node*, std::string> place(const std::string& path) const;
  NodePointer open_file(int fd) const;
  void rename(std::vector<NewName> names);
  void change(Node& node, Change change);
  void sync(Node& node);
  void fail_sync(Node& node);

  NodePointer root_;
  std::vector<NodePointer> folders_;  // all that there ever were, so that pointers to them hold
  std::map<int, NodePointer> open_;
  std::list<Renaming> renamings_;  // that are not durable, in order
  std::mt19937_64 random_;         // what reaches the disk of a sync that fails
};

}  // namespace relmap::testing
