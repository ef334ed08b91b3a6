#pragma once

// Canonical text of a viewer's scenes, settings and requests. The text of two runs is equal if the decisions are.
// Objects have numbers in the order in which they first appear. Coordinates have nine digits.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/viewer.hpp"

namespace cumulet::test {

/// Numbers objects in the order in which they are first found. The number of a destroyed object is not used again.
class Identities {
 public:
  struct Found {
    std::size_t number = 0;
    bool is_new = false;
  };
  Found find(const std::weak_ptr<const void>& object);

 private:
  std::map<std::weak_ptr<const void>, std::size_t, std::owner_less<std::weak_ptr<const void>>> numbers_;
};

/// Numbers identifiers in the same way.
class Numbers {
 public:
  std::size_t operator[](std::uint64_t id) { return numbers_.try_emplace(id, numbers_.size() + 1).first->second; }

 private:
  std::map<std::uint64_t, std::size_t> numbers_;
};

/// Nine digits; numbers below 1e-12 are 0, because they are rounding errors.
std::string text_of(double value);
std::string text_of(const glm::dvec3& v);
/// Returns the parts of an affine transform that differ from the identity.
std::string text_of(const glm::dmat4& m);
std::string text_of(const Error& error);
std::string text_of(Progress::Stage stage);
std::string text_of(const viewer::SurfaceChoice& choice);
std::string text_of(const light::Day& day);

class StageText {
 public:
  using Lines = std::vector<std::string>;

  std::string volume(const viewer::VolumeAssetPtr& volume);
  std::string asset(const std::shared_ptr<const viewer::SurfaceAsset>& asset);
  std::string live(const std::shared_ptr<viewer::Live>& live);
  std::string plan(const scene::GridPlanPtr& plan);
  std::string environment(const light::EnvironmentPtr& environment);
  std::string settings(const viewer::BuildSettings& settings);
  std::string settings(const std::optional<viewer::BuildSettings>& settings);
  std::string request(const viewer::GridRequest& request);
  std::string request(const viewer::PoseRequest& request);
  std::string request(const viewer::FrameRequest& request);
  std::string player(viewer::JobLog::Player player);

  /// Describes the parts of a scene that differ from the scene before; null: all parts.
  Lines scene(const scene::Snapshot& now, const scene::Snapshot* before);

 private:
  std::string source(const scene::MarchSourcePtr& source);
  std::string source(const scene::ModelSourcePtr& source);
  std::string object(std::uint64_t id);
  std::string frame(const scene::SequenceFrame& frame);
  std::string volume(const scene::Volume& volume, const scene::Snapshot* before);
  std::string model(const scene::Model& model);

  Identities volumes_, assets_, lives_, files_, plans_, lattices_, environments_, sources_, models_;
  Numbers objects_, players_, sequences_, taken_;
};

/// Text of the parts of a shot other than its scene, by name.
std::map<std::string, std::string> texts_of(const viewer::Shot& shot);

}  // namespace cumulet::test
