#include "tools/batch/batch_progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <ostream>

#include "tools/terminal/console.h"

namespace relmap::batch {

namespace {

constexpr std::chrono::milliseconds kRedraw{100}, kNextLine{10000};

std::string rate(std::uint64_t amount, std::chrono::steady_clock::duration time) {
  const double seconds = std::chrono::duration<double>(time).count();
  return seconds > 0.5 ? terminal::fixed(static_cast<double>(amount) / seconds, 1) + "/s" : "";
}

// The unit in which recordings are counted.
const char* unit_of(const Task& task) { return task.sequence.pictures > 0 ? " pictures" : " pairs"; }
const char* unit_of(const std::vector<Task>& tasks) {
  const auto is_photographs = [](const Task& task) { return task.sequence.pictures > 0; };
  return std::all_of(tasks.begin(), tasks.end(), is_photographs) ? " pictures" : " pairs";
}

std::string running_line(const Task& task) {
  const Progress& p = task.progress;
  std::string line = "  " + task.sequence.session + "  ";
  if (p.of > 0) line += terminal::bar_text(std::min(p.pairs, p.of), p.of) + "  ";
  line += std::to_string(p.pairs) + (p.of > 0 ? " of " + std::to_string(p.of) : "") + unit_of(task) + "  " +
          rate(p.pairs, std::chrono::steady_clock::now() - task.begun) + "  " + std::to_string(p.settled) + " of " +
          std::to_string(p.keyframes) + " keyframes in the map";
  if (!p.trouble.empty()) line += "  " + p.trouble;
  return line;
}

struct TerminalSize {
  std::size_t rows = 24, columns = 80;
};
TerminalSize terminal_size() {
  winsize size{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {size.ws_row, size.ws_col};
}

// Cuts a line to the terminal's width: a wrapped line could not be erased.
std::string cut(const std::string& line, std::size_t columns) {
  std::size_t bytes = 0;
  for (std::size_t seen = 0; bytes < line.size() && seen + 1 < columns; ++seen) {
    ++bytes;
    while (bytes < line.size() && (static_cast<unsigned char>(line[bytes]) & 0xc0) == 0x80) ++bytes;
  }
  return line.substr(0, bytes);
}

}  // namespace

Extent extent_of(const std::vector<Task>& tasks) {
  Extent extent;
  double done = 0, all = 0;
  for (const Task& task : tasks) {
    if (task.stage == Stage::kWasThere) continue;
    all += 1;
    if (task.stage == Stage::kRunning) {
      extent.pairs += task.progress.pairs;
      if (task.progress.of > 0)
        done += std::min(1.0, static_cast<double>(task.progress.pairs) / static_cast<double>(task.progress.of));
    } else if (task.stage != Stage::kWaiting) {
      extent.pairs += task.summary.pairs;
      done += 1;
    }
  }
  extent.share = all > 0 ? done / all : 1;
  return extent;
}

std::string BatchProgress::total(const std::vector<Task>& tasks) const {
  const auto is_over = [](const Task& task) { return task.stage != Stage::kWaiting && task.stage != Stage::kRunning; };
  const auto over = static_cast<std::uint64_t>(std::count_if(tasks.begin(), tasks.end(), is_over));
  const Extent extent = extent_of(tasks);
  const auto time = Clock::now() - begun_;
  const double seconds = std::chrono::duration<double>(time).count();
  std::string line = std::to_string(over) + " of " + std::to_string(tasks.size()) + " recordings, " +
                     std::to_string(extent.pairs) + unit_of(tasks);
  if (const std::string speed = rate(extent.pairs, time); !speed.empty()) line += ", " + speed;
  if (extent.share > 0.01 && extent.share < 1 && seconds > 2)
    line += ", " + terminal::duration_text(seconds * (1 - extent.share) / extent.share) + " left";
  return line;
}

void BatchProgress::tell_finished(const std::vector<Task>& tasks) {
  stages_.resize(tasks.size(), Stage::kWaiting);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const Task& task = tasks[i];
    if (std::exchange(stages_[i], task.stage) == task.stage) continue;
    std::string text;
    if (task.stage == Stage::kWasThere)
      text = "in the map already";
    else if (task.stage == Stage::kDone)
      text =
          std::to_string(task.summary.pairs) + unit_of(task) + ", " + std::to_string(task.summary.keyframes) +
          " keyframes" +
          (task.summary.refused_in_all() > 0 ? ", " + std::to_string(task.summary.refused_in_all()) + " of them refused"
                                             : "") +
          (task.untrusted() ? ", not to be trusted" : "");
    else if (task.stage == Stage::kFailed)
      text = task.failure.to_string();
    else
      continue;
    erase();
    err_ << task.sequence.session << ": " << text << '\n';
  }
}

void BatchProgress::show(const std::vector<Task>& tasks) {
  tell_finished(tasks);
  const auto now = Clock::now();
  if (now - shown_ < (terminal_ ? kRedraw : kNextLine)) return;
  const bool first = shown_ == Clock::time_point{};
  shown_ = now;
  if (!terminal_) {
    if (!first) err_ << total(tasks) << '\n' << std::flush;
    return;
  }
  const auto [rows, columns] = terminal_size();
  std::string text;
  std::size_t lines = 1;
  for (const Task& task : tasks) {
    if (task.stage != Stage::kRunning || lines + 2 > rows) continue;
    text += cut(running_line(task), columns) + "\x1b[K\n";
    ++lines;
  }
  const Extent extent = extent_of(tasks);
  const std::string bar = terminal::bar_text(static_cast<std::uint64_t>(1000 * extent.share), 1000);
  text += cut(bar + "  " + total(tasks), columns) + "\x1b[K\n";
  erase();
  err_ << text << std::flush;
  lines_ = lines;
}

void BatchProgress::erase() {
  if (lines_ > 0) err_ << "\x1b[" << lines_ << "A\x1b[J";
  lines_ = 0;
}

void BatchProgress::end() {
  erase();
  err_ << std::flush;
}

}  // namespace relmap::batch
