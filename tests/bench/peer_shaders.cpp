#include "peer_shaders.hpp"

#include <array>
#include <stdexcept>
#include <string>

#include "gl/bindings.hpp"

namespace cumulet::bench {

namespace {

constexpr const char* march = "#include \"traversal/march_voxel.glsl\"";
constexpr const char* fly_begins = "// Marches at most CM_CHUNK cells.";
constexpr const char* fly_ends = "// What the path does once its ray has come to an event.";

}  // namespace

std::unique_ptr<EditedShaders> peer_shaders(NanoType type, Look look) {
  if (type == NanoType::fpn) throw std::runtime_error("the NanoVDB march has no kernel for FpN");
  const std::string with_type = std::string("#define CM_NANO_TYPE ") +
                                (type == NanoType::fp16 ? "PNANOVDB_GRID_TYPE_FP16" : "PNANOVDB_GRID_TYPE_FLOAT") +
                                "\n#include \"march_hdda.glsl\"";
  const std::string with_flight = std::string("#define CM_RATIO ") + (look == Look::ratio ? "1" : "0") +
                                  "\n#include \"flight_hdda.glsl\"\n#if 0\n" + fly_begins;
  const std::string after_flight = std::string("#endif\n") + fly_ends;
  const std::array edits{
      Edit{"traversal/march.glsl", march, with_type.c_str()},
      Edit{"path/free_flight.glsl", fly_begins, with_flight.c_str()},
      Edit{"path/free_flight.glsl", fly_ends, after_flight.c_str()},
      // No transmittance is known: that of a shadow ray is in its radiance, and depths are those of majorants.
      Edit{"path/path.glsl", "  float depth = p.depth_0 - p.depth;\n", "  float depth = 0.0f;\n"},
      Edit{"path/path_vertex.glsl", "#define CM_SHADOW_DEPTH 2.0f", "#define CM_SHADOW_DEPTH 0.0f"},
      Edit{"path/path.glsl", "  p.depth = p.depth_0;\n  float ground = ",
           "  p.depth = p.depth_0;\n  if (to_light) p.depth_0 = 1.0f;\n  float ground = "},
  };
  const std::filesystem::path ours = source_folder(CUMULET_BENCH_DIR, "CUMULET_BENCH_PEERS");
  const std::filesystem::path theirs = source_folder(CUMULET_NANOVDB_INCLUDE, "CUMULET_BENCH_PEERS");
  const std::array<std::filesystem::path, 3> files{ours / "march_hdda.glsl", ours / "flight_hdda.glsl",
                                                   theirs / "nanovdb/PNanoVDB.h"};
  return std::make_unique<EditedShaders>(edits, files);
}

BoundGrid::BoundGrid(gl::FunctionsPtr gl, std::span<const std::uint32_t> words, std::uint64_t block_bytes)
    : gl_(std::move(gl)) {
  const std::uint64_t most =
      block_bytes != 0 ? block_bytes : static_cast<std::uint64_t>(gl::query_limits(*gl_).storage_block_bytes);
  if (words.size_bytes() > most) {
    throw std::runtime_error("a NanoVDB grid of " + std::to_string(words.size_bytes()) +
                             " bytes; this driver's GL_MAX_SHADER_STORAGE_BLOCK_SIZE is " + std::to_string(most));
  }
  buffer_ = gl::make_buffer(gl_, words.size_bytes(), words.data(), 0, "creating a NanoVDB grid");
  bind();
}

void BoundGrid::bind() const {
  gl_->BindBufferBase(GL_SHADER_STORAGE_BUFFER, core::CM_STORAGE_MODEL_NODES, buffer_.name());
}

}  // namespace cumulet::bench
