// Binding numbers; C++ has the same (gl/bindings.hpp). Programs that share a resource use the same number for it. Two
// names may share a number if no program uses both.
#ifndef CM_BINDINGS_GLSL
#define CM_BINDINGS_GLSL

// Limits that cumulet.h promises to the host, and that StateGuard can save: GL's minima for compute shaders.
const int CM_UNITS = 16;
const int CM_BUFFERS = 8;  // of storage buffers, and of uniform buffers
const int CM_IMAGES = 8;

// Texture units. Kernels of paths and views:
const int CM_UNIT_CELLS = 0;        // to 5: pages of cell records
const int CM_UNIT_CHANNEL_VOXELS = 0;  // to 4: channels of voxels, in the order of grid::Channel
const int CM_UNIT_CHANGE_VOXELS = 5;   // or changes of bricks' values
const int CM_UNIT_CHANNELS = 6;     // channels of cells
const int CM_UNIT_ENVIRONMENT = 7;  // a page of a WordHeap
const int CM_UNIT_LAYER_COLOR = 8;
const int CM_UNIT_SCENE_WORDS = 9;  // a page of a WordHeap, like the tree
const int CM_UNIT_ATLAS = 10;
const int CM_UNIT_HOST_DEPTH = 11;
const int CM_UNIT_TREE = 12;
const int CM_UNIT_VOXELS = 13;  // or brick values
const int CM_UNIT_BRICK_SLOTS = 14;
const int CM_UNIT_LAYER_Z = 15;
// resolve.comp and composite.frag:
const int CM_UNIT_SUM = 0;
const int CM_UNIT_COUNTS = 1;
const int CM_UNIT_VOLUME_Z = 2;
const int CM_UNIT_SUM_BEFORE = 3;
const int CM_UNIT_COUNTS_BEFORE = 4;
const int CM_UNIT_BACKGROUND = 5;
const int CM_UNIT_BACKGROUND_BEFORE = 6;
const int CM_UNIT_DISPLAY_LUT = 7;
// host_depth.comp:
const int CM_UNIT_DEPTH_SOURCE = 0;
// pack_bricks.comp:
const int CM_UNIT_HOST_VOXELS = 0;
// denoise_*.comp:
const int CM_UNIT_DENOISE_COLOR = 0;
const int CM_UNIT_DENOISE_ALBEDO = 1;
const int CM_UNIT_DENOISE_NORMAL = 2;
const int CM_UNIT_MOMENTS = 7;       // denoise_guides.comp and wavelet_*.comp, beside those of resolve.comp
const int CM_UNIT_GUIDE_EMISSION = 2;
const int CM_UNIT_GUIDE_ALBEDO = 8;
const int CM_UNIT_GUIDE_NORMAL = 9;
const int CM_UNIT_GUIDE_TRANSMITTANCE = 10;
const int CM_UNIT_GUIDE_SURFACE_Z = 11;
const int CM_UNIT_GUIDE_VOLUME_Z = 12;
const int CM_UNIT_WAVELET_FRONT = 13;
const int CM_UNIT_WAVELET_SPREAD = 14;
const int CM_UNIT_WAVELET_GUIDES = 15;
const int CM_UNIT_WAVELET_UNFILTERED = 7;  // wavelet_blend.comp
const int CM_UNIT_HISTORY_LIGHT = 1;   // wavelet_reproject.comp, wavelet_merge.comp
const int CM_UNIT_HISTORY_GUIDES = 2;
// surface.frag:
const int CM_UNIT_MAPS = 0;  // to 9, in the order of surface_parameters.glsl
const int CM_UNIT_GGX_ALBEDO = 10;
const int CM_UNIT_PREFILTERED = 11;

// Uniform buffers.
const int CM_UNIFORM_PARAMETERS = 0;
const int CM_UNIFORM_SURFACE_VIEW = 0;
const int CM_UNIFORM_MATERIAL = 1;
const int CM_UNIFORM_BRICK_POINTS = 0;  // grid_lattice.comp
const int CM_UNIFORM_CELL_PARTS = 0;    // grid_records.comp, grid_channels.comp
const int CM_UNIFORM_BRICK_TREE = 0;    // summarize_bricks.comp, own_priorities.comp
const int CM_UNIFORM_POINT_INDICES = 1;  // own_priorities.comp

// Storage buffers.
const int CM_STORAGE_PATHS = 0;
const int CM_STORAGE_BLOCKS = 1;
const int CM_STORAGE_QUEUES = 2;
const int CM_STORAGE_ANALYTIC_LIGHTS = 3;
const int CM_STORAGE_INSTANCES = 4;
const int CM_STORAGE_INSTANCE_NODES = 5;
const int CM_STORAGE_MODELS = 6;
const int CM_STORAGE_MODEL_NODES = 7;
const int CM_STORAGE_MOTION = 0;         // aovs.comp
const int CM_STORAGE_MATTES = 0;         // cryptomatte.comp
const int CM_STORAGE_ERRORS = 1;         // noise.comp
const int CM_STORAGE_DEPTH_CHANGED = 0;  // host_depth.comp
const int CM_STORAGE_SIGN = 0;           // sign.comp
const int CM_STORAGE_PACKED_BRICKS = 0;  // pack_bricks.comp
const int CM_STORAGE_PACKED_VALUES = 1;
const int CM_STORAGE_PACKED_CHOICE = 2;
const int CM_STORAGE_HOST_VOXELS = 3;
const int CM_STORAGE_BRICKS_KEPT = 2;  // summarize_bricks.comp
const int CM_STORAGE_BRICK_SUMMARIES = 3;
const int CM_STORAGE_BRICKS_FROM = 0;  // copy_bricks.comp
const int CM_STORAGE_BRICKS_TO = 1;
const int CM_STORAGE_BRICKS_MOVED = 2;
const int CM_STORAGE_BRICKS_TOGETHER = 0;  // brick_products.comp, channel_numbers.comp
const int CM_STORAGE_BRICKS_EMISSIVE = 1;
const int CM_STORAGE_BRICKS_FIRST = 2;
const int CM_STORAGE_BRICKS_SECOND = 3;
const int CM_STORAGE_BRICKS_THIRD = 4;
const int CM_STORAGE_BRICKS_NUMBERS = 1;
const int CM_STORAGE_BRICKS_TO_RATE = 2;  // own_priorities.comp
const int CM_STORAGE_BRICKS_LIT = 3;
const int CM_STORAGE_DENOISE_BINS = 0;   // denoise_*.comp
const int CM_STORAGE_DENOISE_CHANNELS = 1;
const int CM_STORAGE_DENOISE_WEIGHTS = 2;
const int CM_STORAGE_GRID_STATE = 0;  // grid_*.comp
const int CM_STORAGE_GRID_PRIORITIES = 1;
const int CM_STORAGE_LATTICE_ENTRIES = 2;
const int CM_STORAGE_GRID_BLOCKS = 3;
const int CM_STORAGE_GRID_NODES = 4;
const int CM_STORAGE_GRID_LEVELS = 5;
const int CM_STORAGE_GRID_OWN = 6;
const int CM_STORAGE_GRID_BINS = 7;
const int CM_STORAGE_GRID_COARSE = 1;
const int CM_STORAGE_GRID_CORNERS = 1;  // grid_records.comp, of cells in bricks
const int CM_STORAGE_GRID_CELLS = 3;
const int CM_STORAGE_GRID_LINKS = 4;
const int CM_STORAGE_GRID_LIST = 5;
const int CM_STORAGE_GRID_BELOW = 6;
const int CM_STORAGE_GRID_RECORDS = 6;
const int CM_STORAGE_GRID_BRICKS = 7;
const int CM_STORAGE_GRID_TREE = 7;
const int CM_STORAGE_GRID_CHANNEL = 4;  // grid_channels.comp, grid_emissive.comp
const int CM_STORAGE_GRID_GLOWING = 7;
const int CM_STORAGE_GRID_CLEAR = 7;  // grid_clear.comp

// Images.
const int CM_IMAGE_SUM = 0;
const int CM_IMAGE_COUNTS = 1;
const int CM_IMAGE_VOLUME_SUM = 2;
const int CM_IMAGE_BACKGROUND = 3;
const int CM_IMAGE_MOMENTS = 4;
const int CM_IMAGE_GROUPS = 5;
const int CM_IMAGE_VOLUME_Z = 2;  // inspect.comp, aovs.comp
const int CM_IMAGE_NORMAL = 0;    // aovs.comp
const int CM_IMAGE_ALBEDO = 1;
const int CM_IMAGE_TRANSMITTANCE = 3;
const int CM_IMAGE_SURFACE_Z = 4;
const int CM_IMAGE_EMISSION = 5;
const int CM_IMAGE_VELOCITY = 6;
const int CM_IMAGE_MOTION = 7;
const int CM_IMAGE_MATTES = 0;      // cryptomatte.comp
const int CM_IMAGE_MEANS = 0;       // resolve.comp
const int CM_IMAGE_BACKGROUND_MEANS = 1;
const int CM_IMAGE_HOST_DEPTH = 0;  // host_depth.comp
const int CM_IMAGE_TRANSMITTANCE_MAP = 0;  // transmittance.comp
const int CM_IMAGE_DENOISED = 0;    // denoise_convolution.comp
const int CM_IMAGE_GUIDE_COLOR = 0;  // denoise_guides.comp
const int CM_IMAGE_GUIDE_ALBEDO = 1;
const int CM_IMAGE_GUIDE_NORMAL = 2;
const int CM_IMAGE_GUIDE_MISSING = 3;
const int CM_IMAGE_WAVELET_FRONT = 2;  // wavelet_*.comp, beside those of resolve.comp
const int CM_IMAGE_WAVELET_SPREAD = 3;
const int CM_IMAGE_WAVELET_GUIDES = 4;
const int CM_IMAGE_WAVELET_UNFILTERED = 4;  // wavelet_variance.comp
const int CM_IMAGE_WAVELET_BEHIND = 5;
const int CM_IMAGE_HISTORY_LIGHT = 6;
const int CM_IMAGE_HISTORY_GUIDES = 7;

#endif
