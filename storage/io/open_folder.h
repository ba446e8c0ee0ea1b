// A folder that is open, so that it stays the same whatever happens to its name: someone may move it, or put another
// folder or a link in its place. What is written by path() goes into this folder all the same.
#pragma once

#include <memory>
#include <string>

#include "proto/base/status.h"

struct stat;

namespace relmap::storage {

class OpenFolder {
 public:
  // Follows links. NO_SUCH_FILE, IO_ERROR.
  static Result<std::unique_ptr<OpenFolder>> open(const std::string& path);
  ~OpenFolder();
  OpenFolder(const OpenFolder&) = delete;
  OpenFolder& operator=(const OpenFolder&) = delete;

  // A folder in this one. NOT_ALLOWED if it is a link, or no folder; NO_SUCH_FILE, IO_ERROR.
  Result<std::unique_ptr<OpenFolder>> child(const std::string& name) const;
  // The same; if nothing is there it is made, for this user only.
  Result<std::unique_ptr<OpenFolder>> make(const std::string& name) const;

  // By which it can be reached while it is open.
  std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }
  // What it is called now.
  std::string name() const;
  bool empty() const;
  bool ours() const;           // it belongs to this user
  bool private_to_us() const;  // only this user, or root, can change what is in it
  // Whether only this user, or root, can change where a path leads: nobody else owns a folder on the way to it, its
  // links followed, or may put something into one. (Where a sticky bit is set, names of others cannot be taken away.)
  static bool is_safe_way(const std::string& path);
  bool has(const std::string& name, const OpenFolder& other) const;  // `name` in this folder is `other`
  bool exists(const std::string& name) const;                        // a link that leads nowhere exists, too

  // IO_ERROR.
  Status restrict_to_owner() const;
  // Nothing may stand at `to`, except an empty folder where the file system cannot tell.
  Status rename(const std::string& from, const std::string& to) const;
  Status sync() const;
  // Removes a folder in this one, if it is empty.
  bool remove_empty(const std::string& name) const;
  // Removes what is in it, but what is called `but`. Links are removed, not followed.
  void clear(const std::string& but = {}) const;

 private:
  explicit OpenFolder(int fd) : fd_(fd) {}
  static Result<std::unique_ptr<OpenFolder>> open_at(int folder, const std::string& name, int flags);
  void facts(struct stat& facts) const;

  const int fd_;
};

}  // namespace relmap::storage
