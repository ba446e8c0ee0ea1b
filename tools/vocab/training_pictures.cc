#include "tools/vocab/training_pictures.h"

#include <algorithm>
#include <atomic>
#include <thread>

#include "frontend/vision/picture_appearance.h"
#include "proto/base/mutex.h"
#include "tools/vocab/training_views.h"

namespace relmap::vocab {
namespace {

using Descriptors = std::vector<place::Descriptor>;

constexpr std::size_t kMinFeatures = 50;  // a picture with fewer of its some 300 features shows no place

Result<std::vector<Descriptors>> describe_file(const std::string& file, std::size_t views) {
  const auto pictures = training_views(file, views);
  if (!pictures.ok()) return pictures.status();
  std::vector<Descriptors> result;
  for (const vision::Image& picture : *pictures) {
    const std::vector<AppearanceFeature> features = vision::picture_appearance(picture);
    if (features.size() < kMinFeatures) continue;
    auto& descriptors = result.emplace_back();
    for (const AppearanceFeature& feature : features) descriptors.push_back(feature.descriptor);
  }
  return result;
}

// OpenCV refuses some pictures by throwing, which would end the program on a thread.
Result<std::vector<Descriptors>> describe_safely(const std::string& file, std::size_t views) {
  try {
    return describe_file(file, views);
  } catch (const std::exception& error) {
    return Status(Reason::NOT_A_PICTURE, file + ": " + error.what());
  }
}

}  // namespace

Result<std::vector<Descriptors>> describe_pictures(const std::vector<std::string>& files, std::size_t views,
                                                   const std::function<void(double)>& progress) {
  std::vector<std::vector<Descriptors>> of_file(files.size());
  std::atomic<std::size_t> next = 0;
  struct {
    Mutex mutex;  // `progress` is called under it, too
    std::size_t done RELMAP_GUARDED_BY(mutex) = 0;
    Status failure RELMAP_GUARDED_BY(mutex);
  } shared;
  const auto work = [&] {
    for (std::size_t i; (i = next++) < files.size();) {
      auto described = describe_safely(files[i], views);
      const MutexLock lock(shared.mutex);
      if (!described.ok()) {
        shared.failure = described.status();
        next = files.size();
        return;
      }
      of_file[i] = std::move(described).value();
      progress(static_cast<double>(++shared.done) / static_cast<double>(files.size()));
    }
  };
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  {
    const MutexLock lock(shared.mutex);
    if (!shared.failure.ok()) return shared.failure;
  }

  std::vector<Descriptors> result;
  for (auto& pictures : of_file) std::move(pictures.begin(), pictures.end(), std::back_inserter(result));
  return result;
}

}  // namespace relmap::vocab
