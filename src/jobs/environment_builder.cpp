#include "jobs/environment_builder.hpp"

#include "base/detached_work.hpp"
#include "light/environment_file.hpp"

namespace cumulet::viewer {

void EnvironmentBuilder::load(const FilePath& path) {
  if (job_log() != nullptr) job_log()->load_environment(path);
  const std::scoped_lock lock(mutex_);
  files_.replace({path.given(), Progress::Stage::loading,
                  [this, path](Progress& progress) {
                    light::EnvironmentPtr made = light::open_environment(path, &progress);
                    const std::scoped_lock handing(mutex_);
                    progress.check();
                    environment_ = std::move(made);
                  },
                  true});
}

void EnvironmentBuilder::make_sky(const light::Day& day) {
  if (job_log() != nullptr) job_log()->make_sky(day);
  skies_.post({"computing the sky", Progress::Stage::idle, [this, day](Progress& progress) {
                 last_sky_ = run_cancellable(
                     &progress, [day, last = last_sky_] { return light::make_daylight(day, last ? &*last : nullptr); });
                 const std::scoped_lock lock(mutex_);
                 sky_ = last_sky_;
               }});
}

void EnvironmentBuilder::cancel() {
  log_call("environment", "cancel");
  files_.cancel();
}

void EnvironmentBuilder::drop_loads() {
  log_call("environment", "drop loads");
  files_.forget_failure();  // of a load that the new environment replaces
  files_.cancel();
  const std::scoped_lock lock(mutex_);
  environment_.reset();
}

std::optional<light::EnvironmentPtr> EnvironmentBuilder::take_environment() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(environment_, std::nullopt);
}

std::optional<light::Daylight> EnvironmentBuilder::take_sky() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(sky_, std::nullopt);
}

bool EnvironmentBuilder::busy() const {
  // Check in this order: a job stores its result before it ends.
  if (files_.busy() || skies_.busy()) return true;
  const std::scoped_lock lock(mutex_);
  return environment_ || sky_;
}

Worker::Status EnvironmentBuilder::status() const {
  Worker::Status status = files_.status();
  if (!status.failure) status.failure = skies_.status().failure;
  return status;
}

}  // namespace cumulet::viewer
