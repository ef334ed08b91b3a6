// Queues of paths that wait for a kernel. Each kernel runs over its queue and puts each path into that of its next
// stage. A round is
//   trace_travel.comp   the medium's part of paths
//   trace_meet.comp     the tree is asked
//   trace_shade.comp    what happens on triangles
//   trace_camera.comp   samples are added to their pixels, and the next begun
// and a dispatch is trace_camera.comp over all lanes of its blocks (CM_DENSE), and some rounds. After a round no path
// waits but for the next round.
#ifndef CM_PATH_QUEUE_GLSL
#define CM_PATH_QUEUE_GLSL

#define CM_QUEUE_TRAVEL 0u
#define CM_QUEUE_MEET 1u
#define CM_QUEUE_SHADE 2u
#define CM_QUEUE_CAMERA 3u
#define CM_QUEUES 4u
#define CM_MOST_ROUNDS 64u
#define CM_QUEUE_GROUP 64u  // lanes a work group
#define CM_ROUND_LOCATION 0

#ifndef __cplusplus
struct CmQueueHead {
  uint groups;  // what glDispatchComputeIndirect reads: work groups for so many paths, and twice 1
  uint groups_y;
  uint groups_z;
  uint count;
};

layout(std430, binding = CM_STORAGE_QUEUES) buffer CmQueues {
  CmQueueHead cm_heads[CM_QUEUES * (CM_MOST_ROUNDS + 1u)];  // of each round
  uint cm_waiting[];  // lanes: one list a queue, but two of CM_QUEUE_TRAVEL, for this round and the next
};

layout(location = CM_ROUND_LOCATION) uniform uint cm_round;

uint cm_queue_list(uint queue, uint round_number) {
  return (queue == CM_QUEUE_TRAVEL ? (round_number & 1u) * CM_QUEUES : queue) * cm_lanes();
}

void cm_enqueue(uint queue, uint round_number, uint lane) {
  uint head = round_number * CM_QUEUES + queue;
  uint place = atomicAdd(cm_heads[head].count, 1u);
  if (place % CM_QUEUE_GROUP == 0u) atomicAdd(cm_heads[head].groups, 1u);
  cm_waiting[cm_queue_list(queue, round_number) + place] = lane;
}

// This lane's path of a queue in this round.
uint cm_queue_place() { return gl_WorkGroupID.x * CM_QUEUE_GROUP + gl_LocalInvocationIndex; }
uint cm_queue_count(uint queue) { return cm_heads[cm_round * CM_QUEUES + queue].count; }
uint cm_queue_lane(uint queue) { return cm_waiting[cm_queue_list(queue, cm_round) + cm_queue_place()]; }

// Into the queue of its next stage: in this round if that kernel is still to come.
void cm_send_on(CmPath p, uint lane) {
  bool travels = p.stage != CM_STAGE_MEET && p.stage != CM_STAGE_VERTEX && p.stage != CM_STAGE_FINISH;
  uint queue = p.stage == CM_STAGE_MEET
                   ? CM_QUEUE_MEET
                   : (p.stage == CM_STAGE_VERTEX ? CM_QUEUE_SHADE
                                                 : (p.stage == CM_STAGE_FINISH ? CM_QUEUE_CAMERA : CM_QUEUE_TRAVEL));
  cm_enqueue(queue, cm_round + (travels ? 1u : 0u), lane);
}
#endif

#endif
