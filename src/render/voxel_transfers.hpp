#pragma once

// Reads voxels that a host has in GL textures or buffers, into main memory or into GPU-resident bricks.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gl/programs.hpp"
#include "render/brick_kernels.hpp"
#include "render/brick_products.hpp"
#include "render/device_memories.hpp"
#include "render/upload.hpp"
#include "scene/state_in_gl.hpp"
#include "volume/state.hpp"

namespace cumulet::render {

/// One component of a GL_TEXTURE_3D.
struct VoxelTexture {
  GLuint name = 0;
  int component = 0;
};

/// Voxels in a buffer.
struct VoxelBuffer {
  GLuint name = 0;
  VoxelFormat format = VoxelFormat::floats;
  std::uint64_t offset = 0;                   ///< byte offset of voxel 0
  std::array<std::uint64_t, 3> strides = {};  ///< bytes along x, y and z; all zero: tightly packed, x fastest
  glm::ivec3 size{0};
};

struct GlVoxels {
  volume::Channel channel;
  std::variant<VoxelTexture, VoxelBuffer> source;
  glm::dmat4 index_to_world{1.0};
};

/// Both ends inclusive.
struct VoxelBox {
  glm::ivec3 min{0};
  glm::ivec3 max{0};
};

struct GlState {
  std::string name;  ///< prefix of every error message
  std::vector<GlVoxels> fields;
  std::optional<std::vector<VoxelBox>> changed;  ///< nullopt: all of it
  GLsync wait = nullptr;                         ///< the device waits for it first
};

/// Packs the nonempty bricks of a host's voxels on the device at once, and takes them to main memory when they have
/// arrived. Never waits. All calls except the queries need a current context and an active StateGuard.
class VoxelTransfers {
 public:
  /// memories: for bricks that stay GPU-resident.
  VoxelTransfers(gl::FunctionsPtr gl, gl::ProgramsPtr programs, const gl::Limits& limits, DeviceMemoriesPtr memories);

  /// Receives the fields as copies of bricks. For an update, empty bricks are included as zeros.
  using Arrive = std::function<void(std::vector<volume::FieldCopy> fields)>;
  /// The fields stay GPU-resident.
  struct StayInGl {
    /// Combines the transferred fields, given in their order, into a new state, including the products of the state
    /// that it updates. Returns nullopt if that state is no longer on the GPU. Bricks of an update are not yet sorted
    /// and merged.
    std::function<std::optional<scene::StateInGl>(const std::vector<scene::StateInGl::Field>& fields)> join;
    /// Returns the settings for which emission is needed.
    std::function<std::vector<scene::Emission>()> wanted;
    /// Receives the state with exactly the needed products. Returns false if the state that it updates has changed in
    /// the meantime; the fields are joined again then.
    std::function<bool(scene::StateInGl state)> arrive;
    /// Receives an update in main memory if the state that it updates is there; null: the update is dropped.
    Arrive instead;
    volume::ValuesWantedPtr values_wanted;  ///< for the values of its bricks; null: they are never requested
  };
  using Arrival = std::variant<Arrive, StayInGl>;
  /// Called if a complete state is invalid. Updates of it that were in flight are dropped.
  using Refuse = std::function<void()>;
  /// Starts a transfer. whose: identifies the volume. If several complete states of one volume are in flight, the
  /// oldest and the newest arrive; others are dropped. The caller must have checked channels and transforms. Throws
  /// Error(invalid_argument) for invalid objects, Error(unsupported) beyond the driver's limits, and the errors of GL
  /// allocations; then nothing has changed.
  void begin(const GlState& state, const void* whose, Arrival arrival, Refuse refuse);
  /// Transfers a GPU-resident state to main memory, as a complete state, after the transfers in flight. find: returns
  /// the state at that time; null: nothing is transferred. channels: channels of the state.
  using Find = std::function<scene::StateInGlPtr()>;
  void bring_back(const void* whose, const std::vector<volume::Channel>& channels, Find find, Arrive arrive,
                  Refuse refuse);
  /// Computes missing products of the state that stay.join returns for no fields, after the transfers in flight.
  /// Nothing arrives if no product is missing or there is no state.
  void make_products(const void* whose, std::string name, StayInGl stay);
  /// The newest complete state of a volume in flight.
  struct Announced {
    std::vector<volume::Channel> channels;
    bool gpu_resident = false;
    glm::dmat4 index_to_world{1.0};  ///< of the first field
  };
  /// nullopt: there is none.
  [[nodiscard]] std::optional<Announced> announced(const void* whose) const;
  /// True if any transfer is in flight.
  [[nodiscard]] bool busy() const { return !transfers_.empty(); }
  /// Processes transfers that have arrived, until about the deadline. Throws the errors of the callbacks, and
  /// Error(file) for voxels that are not finite. The state is then dropped, with its updates if it is a complete one.
  /// The next call continues.
  void follow(Deadline deadline);
  /// GL memory.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // A texture or buffer of the host that has been checked.
  struct Source {
    GLuint texture = 0;
    int component = 0;
    GLuint buffer = 0;
    std::uint64_t offset = 0;
    glm::u64vec3 strides{0};
    glm::ivec3 size{0};
    VoxelFormat format = VoxelFormat::floats;
  };
  // Buffers for a number of packed bricks, empty ones included.
  struct Room {
    std::size_t bricks = 0;
    std::size_t bytes = 0;  // of values
    std::size_t back_bytes = 0;
    gl::Object packed_bricks;
    gl::Object values;
    gl::ReadBack packed_bricks_back;
    gl::ReadBack values_back;
    std::size_t expected = 0;  // bricks filled last time
    std::size_t summed = 0;    // capacity of the summaries
    gl::Object summaries;
    gl::ReadBack summaries_back;

    [[nodiscard]] std::uint64_t all_bytes() const {
      return 2 * packed_bricks_bytes(bricks) + bytes + back_bytes + 2 * summed * sizeof(volume::BrickSummary);
    }
  };
  static std::size_t packed_bricks_bytes(std::size_t bricks) { return (2 + bricks) * sizeof(std::uint32_t); }
  // Layers of bricks of a field that one dispatch packs.
  struct Piece {
    std::size_t field = 0;
    std::uint32_t first = 0;  // first brick, or index in the list of chosen bricks
    std::uint32_t count = 0;
    glm::ivec2 layers{0};  // first, end
    Room room;
    std::size_t copied = 0;                      // bricks read back before their number was known
    std::size_t taken = 0;                       // bricks processed, filled and emptied ones
    std::shared_ptr<volume::DeviceMemory> kept;  // GPU-resident bricks; null: there are none
    std::uint32_t filled = 0;                    // bricks in `kept`
    std::uint32_t summarized = 0;                // bricks of these that have been summarized
  };
  // A GPU-resident state on its way to main memory.
  struct Return {
    Find find;
    scene::StateInGlPtr state;                        // set by find
    std::vector<std::vector<gl::ReadBack>> memories;  // per memory of each field
    std::size_t field = 0;
    std::size_t taken = 0;  // bricks processed of that field
  };
  // A GPU-resident state whose products are being computed.
  struct Staying {
    std::vector<scene::StateInGl::Field> fields;  // the transferred fields
    std::optional<scene::StateInGl> state;
    std::vector<scene::ProductInGl> kept;  // unchanged products
    std::deque<BrickProducts> making;
    std::exception_ptr failure;  // error of a product; main memory computes it otherwise
  };
  struct Transfer {
    const void* whose = nullptr;
    bool whole = true;
    std::string name;
    std::vector<Source> sources;
    std::vector<Piece> pieces;
    std::vector<volume::FieldCopy> fields;
    bool finite = true;
    Arrival arrival;
    Refuse refuse;
    gl::Fence fence;
    bool counted = false;   // the number of filled bricks is known, and they have been copied
    gl::Object brick_tree;  // only while it is summarized
    std::optional<Return> back;
    std::optional<Staying> staying;  // set when its fields have arrived

    [[nodiscard]] bool gpu_resident() const { return std::holds_alternative<StayInGl>(arrival); }
    // True for make_products().
    [[nodiscard]] bool makes() const { return sources.empty() && !back; }
  };

  // Origins of the bricks that were packed.
  class PackedBricks;
  static PackedBricks read_packed_bricks(const Transfer& transfer, const Piece& piece);

  [[nodiscard]] Source open(const GlVoxels& field, const std::string& what) const;
  [[nodiscard]] Source open_texture(const VoxelTexture& texture, const std::string& what) const;
  [[nodiscard]] Source open_buffer(const VoxelBuffer& buffer, const std::string& what) const;
  // Returns the byte range of these layers of bricks (first, end) in the buffer: begin, end.
  [[nodiscard]] glm::u64vec2 range_of(const Source& source, glm::ivec2 layers) const;
  // chosen: bricks to pack; null: all.
  void plan(Transfer& transfer, std::size_t field, const std::vector<std::uint32_t>* chosen,
            const std::string& what) const;
  [[nodiscard]] Room take_room(std::size_t bricks, std::size_t bytes);
  void make_room_back(Room& room, std::size_t bytes) const;
  void pack(const Transfer& transfer, const Piece& piece, GLuint chosen);
  [[nodiscard]] gl::Fence fence() const;
  // Returns whether all of it has been processed.
  bool take(Transfer& transfer, Deadline deadline);
  // Processes a GPU-resident state on its way to main memory.
  bool take_back(Transfer& transfer, Deadline deadline);
  // Processes a state that stays GPU-resident.
  bool take_in_gl(Transfer& transfer, Deadline deadline);
  void join(Transfer& transfer, std::vector<scene::StateInGl::Field> fields);
  // Returns the state with all products that were computed.
  static scene::StateInGl made(Staying& staying);
  // Passes on the state. Returns false if the fields were joined again.
  bool arrive_in_gl(Transfer& transfer);
  // Copies filled bricks beyond the expected number.
  void copy_rest(Transfer& transfer) const;
  // Converts and summarizes GPU-resident bricks. Returns whether all dispatches have been sent.
  bool summarize(Transfer& transfer, Deadline deadline);
  void begin_summaries(Transfer& transfer);
  void summarize(const Transfer& transfer, const Piece& piece, std::uint32_t first, std::uint32_t end) const;
  [[nodiscard]] BrickSummaries summaries_of(const Transfer& transfer, const Piece& piece) const;
  static std::vector<scene::StateInGl::Field> take_fields(Transfer& transfer);
  void recycle(Transfer& transfer);
  using Transfers = std::deque<Transfer>;
  // Removes a transfer that is not needed any more. Returns the next one.
  Transfers::iterator drop(const Transfers::iterator& transfer);
  // Drops the updates behind a complete state, and calls its refuse().
  void refuse_on_top(const Transfer& whole);

  gl::FunctionsPtr gl_;
  gl::ProgramsPtr programs_;
  DeviceMemoriesPtr memories_;
  std::uint64_t max_bytes_;
  std::uint64_t alignment_;
  gl::Object sampler_;
  std::optional<light::BlackBody> body_;  // made when first needed, in about a millisecond
  Transfers transfers_;                   // in the order of begin()
  std::deque<Room> spare_;
  std::size_t max_pieces_ = 0;  // recent maximum per state
  int idle_ = 0;                // calls of follow() without transfers
};

}  // namespace cumulet::render
