/* A host with its own Vulkan: overfly records into the host's command buffers, inside its pass.
 *
 * In:    the picture's file.
 * Out:   hills as a PPM; validation messages on standard output; 1 if there are any.
 * Keeps: nothing.
 * Not here: drawing without Vulkan (flight.c); geometry of the host's own (docs/c.md).
 *
 * record() is the function to read: where overfly's calls stand among the host's. The rest is Vulkan
 * as any program has it.
 */

#include "overfly.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vulkan.h>

enum { WIDTH = 960, HEIGHT = 540, IN_FLIGHT = 2, FRAMES_MAX = 4000, FRAMES_AFTER = 8 };

static const char LAYER[] = "VK_LAYER_KHRONOS_validation";
static const VkFormat COLOUR = VK_FORMAT_R8G8B8A8_SRGB; /* stores linear light with its curve */

/* The preset `earth`, with few enough triangles for a device without a GPU. */
static const char SCENE[] =
    "Scene(body: Wgs84, sources: [Procedural(seed: 2029)], sea: true,"
    " sun: Some((latitude_deg: 10.0, longitude_deg: 170.0)),"
    " lod: (triangles_max: 60000), depth: (ranges: [30.0, 10000.0]))";

typedef struct Plane {
    VkImage image;
    VkDeviceMemory memory;
    VkImageView view;
} Plane;

/* Everything of the host's. */
typedef struct Host {
    VkInstance instance;
    VkDebugUtilsMessengerEXT messenger;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    uint32_t family;
    int validates;
    unsigned messages;
    Plane colour, depth;
    VkFormat depth_format;
    float far_depth; /* what depth is cleared to: infinitely far */
    VkRenderPass pass;
    VkFramebuffer framebuffer;
    VkCommandPool pool;
    VkCommandBuffer buffers[IN_FLIGHT];
    VkFence fences[IN_FLIGHT];
    uint32_t next;
    VkBuffer pixels;
    VkDeviceMemory pixel_memory;
} Host;

static void must(ovf_status status, const char *what) {
    if (status != OVF_OK) {
        fprintf(stderr, "%s: status %d: %s\n", what, (int)status, ovf_last_error());
        exit(1);
    }
}

static void vulkan(VkResult result, const char *what) {
    if (result != VK_SUCCESS) {
        fprintf(stderr, "%s: VkResult %d\n", what, (int)result);
        exit(1);
    }
}

/* ---- overfly among the host's commands ------------------------------------------------------- */

static void begin_pass(const Host *host, VkCommandBuffer buffer) {
    VkClearValue clear[2];
    memset(clear, 0, sizeof clear);
    clear[1].depthStencil.depth = host->far_depth;
    VkRenderPassBeginInfo info = {.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO,
                                  .renderPass = host->pass,
                                  .framebuffer = host->framebuffer,
                                  .renderArea = {.extent = {WIDTH, HEIGHT}},
                                  .clearValueCount = 2,
                                  .pClearValues = clear};
    vkCmdBeginRenderPass(buffer, &info, VK_SUBPASS_CONTENTS_INLINE);
}

static void clear_depth(const Host *host, VkCommandBuffer buffer) {
    VkClearAttachment clear = {.aspectMask = VK_IMAGE_ASPECT_DEPTH_BIT,
                               .clearValue = {.depthStencil = {.depth = host->far_depth}}};
    VkClearRect all = {.rect = {.extent = {WIDTH, HEIGHT}}, .layerCount = 1};
    vkCmdClearAttachments(buffer, 1, &clear, 1, &all);
}

/* A frame's command buffer: what is new goes to the device, then the pass draws the ground from the
 * farthest depth range to the nearest. */
static ovf_draw_report record(const Host *host, ovf_renderer renderer, VkCommandBuffer buffer) {
    ovf_host_frame frame = {
        .struct_size = sizeof frame, .index = host->next, .command_buffer = buffer};
    ovf_picture picture = {.struct_size = sizeof picture, .view = 0};
    ovf_draw_report report = {.struct_size = sizeof report};
    must(ovf_renderer_record_uploads(renderer, &frame, &picture, &report), "uploads");
    begin_pass(host, buffer);
    for (uint32_t range = report.ranges; range-- > 0;) {
        clear_depth(host, buffer);
        must(ovf_renderer_record_range(renderer, &frame, range, 0, 0), "range");
        /* Here the host draws what it has in this range, by ovf_terrain_projection. */
    }
    vkCmdEndRenderPass(buffer);
    return report;
}

static VkCommandBuffer begin(Host *host) {
    VkCommandBufferBeginInfo info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                     .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    VkFence fence = host->fences[host->next];
    vulkan(vkWaitForFences(host->device, 1, &fence, VK_TRUE, UINT64_MAX), "waiting");
    vulkan(vkBeginCommandBuffer(host->buffers[host->next], &info), "beginning");
    return host->buffers[host->next];
}

static void submit(Host *host) {
    VkSubmitInfo info = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                         .commandBufferCount = 1,
                         .pCommandBuffers = &host->buffers[host->next]};
    VkFence fence = host->fences[host->next];
    vulkan(vkEndCommandBuffer(host->buffers[host->next]), "ending");
    vulkan(vkResetFences(host->device, 1, &fence), "resetting a fence");
    vulkan(vkQueueSubmit(host->queue, 1, &info, fence), "submitting");
    host->next = (host->next + 1) % IN_FLIGHT;
}

/* One frame of the terrain, 3000 m above the ellipsoid, a little further east with each step. */
static ovf_frame fly(ovf_terrain terrain, int step, double time_s) {
    const double degree = 3.14159265358979323846 / 180.0;
    ovf_view view = {.struct_size = sizeof view,
                     .eye = OVF_EYE_GEODETIC,
                     .attitude = OVF_ATTITUDE_ANGLES,
                     .width_px = WIDTH,
                     .height_px = HEIGHT,
                     .eye_lat_rad = 46.85 * degree,
                     .eye_lon_rad = (-121.76 + 1e-4 * step) * degree,
                     .eye_height_m = 3000.0,
                     .yaw_rad = 40.0 * degree,
                     .pitch_rad = -8.0 * degree,
                     .field_of_view_rad = 60.0 * degree,
                     .near_m = 0.1};
    ovf_frame_input input = {
        .struct_size = sizeof input, .view_count = 1, .views = &view, .time_s = time_s};
    ovf_frame frame = {.struct_size = sizeof frame};
    must(ovf_terrain_frame(terrain, &input, &frame), "frame");
    return frame;
}

/* Flies until the terrain has come up, then some frames on, which are drawn. */
static void fly_and_draw(Host *host, ovf_terrain terrain, ovf_renderer renderer) {
    int frame = 0;
    for (int comes_up = 1; comes_up; frame++) {
        ovf_frame now = fly(terrain, 0, 0.1 * frame);
        comes_up = now.leaves == 0 || now.splits + now.merges + now.wanted > 0;
        if (frame == FRAMES_MAX) {
            fprintf(stderr, "the terrain has not come up in %d frames\n", FRAMES_MAX);
            exit(1);
        }
    }
    for (int step = 0; step < FRAMES_AFTER; step++, frame++) {
        fly(terrain, step, 0.1 * frame);
        ovf_draw_report report = record(host, renderer, begin(host));
        submit(host);
        printf("frame %d: %u patches uploaded, %u drawn in %u ranges\n", step,
               report.uploaded_patches, report.draws, report.ranges);
    }
}

static ovf_renderer new_renderer(const Host *host, ovf_terrain terrain) {
    ovf_device device = {
        .struct_size = sizeof device,
        .queue_family = host->family,
        .api_version = VK_API_VERSION_1_1,
        .debug_utils = (uint32_t)host->validates,
        .multi_draw_indirect = 1,
        .get_instance_proc_addr = (void (*)(void))vkGetInstanceProcAddr,
        .instance = host->instance,
        .physical_device = host->physical,
        .device = host->device,
        .queue = host->queue,
    };
    ovf_target target = {.struct_size = sizeof target,
                         .render_pass = (uint64_t)host->pass,
                         .colour_format = COLOUR,
                         .depth_format = (uint32_t)host->depth_format,
                         .samples = VK_SAMPLE_COUNT_1_BIT};
    ovf_renderer_settings settings = {
        .struct_size = sizeof settings, .frames_in_flight = IN_FLIGHT};
    ovf_renderer renderer;
    must(ovf_renderer_new_v1(terrain, &settings, &device, &target, &renderer), "renderer");
    return renderer;
}

/* ---- Vulkan as any program has it ------------------------------------------------------------ */

static VKAPI_ATTR VkBool32 VKAPI_CALL collect(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                              VkDebugUtilsMessageTypeFlagsEXT kinds,
                                              const VkDebugUtilsMessengerCallbackDataEXT *data,
                                              void *user) {
    Host *host = user;
    (void)severity, (void)kinds;
    host->messages++;
    printf("%s\n", data->pMessage);
    return VK_FALSE;
}

static int has_layer(void) {
    uint32_t count = 0;
    vulkan(vkEnumerateInstanceLayerProperties(&count, NULL), "layers");
    VkLayerProperties *layers = calloc(count + 1, sizeof *layers);
    vulkan(vkEnumerateInstanceLayerProperties(&count, layers), "layers");
    int found = 0;
    for (uint32_t i = 0; i < count; i++) {
        found |= strcmp(layers[i].layerName, LAYER) == 0;
    }
    free(layers);
    return found;
}

static void open_instance(Host *host) {
    host->validates = has_layer();
    VkValidationFeatureEnableEXT sync = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    VkValidationFeaturesEXT features = {.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                        .enabledValidationFeatureCount = 1,
                                        .pEnabledValidationFeatures = &sync};
    VkApplicationInfo about = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                               .apiVersion = VK_API_VERSION_1_1};
    const char *layers[] = {LAYER};
    const char *extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME,
                                VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
    VkInstanceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                 .pNext = host->validates ? &features : NULL,
                                 .pApplicationInfo = &about,
                                 .enabledLayerCount = host->validates ? 1 : 0,
                                 .ppEnabledLayerNames = layers,
                                 .enabledExtensionCount = host->validates ? 2 : 0,
                                 .ppEnabledExtensionNames = extensions};
    vulkan(vkCreateInstance(&info, NULL, &host->instance), "instance");
    if (!host->validates) {
        return;
    }
    VkDebugUtilsMessengerCreateInfoEXT listen = {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT |
                           VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
                       VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
        .pfnUserCallback = collect,
        .pUserData = host};
    PFN_vkCreateDebugUtilsMessengerEXT create =
        (PFN_vkCreateDebugUtilsMessengerEXT)vkGetInstanceProcAddr(
            host->instance, "vkCreateDebugUtilsMessengerEXT");
    vulkan(create(host->instance, &listen, NULL, &host->messenger), "messenger");
}

/* The first family of the first device that draws and computes. */
static void open_device(Host *host) {
    uint32_t count = 1;
    VkResult found = vkEnumeratePhysicalDevices(host->instance, &count, &host->physical);
    vulkan(found == VK_INCOMPLETE ? VK_SUCCESS : found, "devices");
    if (count == 0) {
        fprintf(stderr, "no Vulkan device\n");
        exit(1);
    }
    VkQueueFamilyProperties families[16];
    uint32_t family_count = 16;
    vkGetPhysicalDeviceQueueFamilyProperties(host->physical, &family_count, families);
    VkQueueFlags both = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
    while (host->family < family_count && (families[host->family].queueFlags & both) != both) {
        host->family++;
    }
    float priority = 1.0f;
    VkDeviceQueueCreateInfo queue = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                     .queueFamilyIndex = host->family,
                                     .queueCount = 1,
                                     .pQueuePriorities = &priority};
    VkPhysicalDeviceFeatures features = {.multiDrawIndirect = VK_TRUE}; /* what overfly needs */
    VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                               .queueCreateInfoCount = 1,
                               .pQueueCreateInfos = &queue,
                               .pEnabledFeatures = &features};
    vulkan(vkCreateDevice(host->physical, &info, NULL, &host->device), "device");
    vkGetDeviceQueue(host->device, host->family, 0, &host->queue);
}

static VkDeviceMemory take_memory(const Host *host, VkMemoryRequirements needs,
                                  VkMemoryPropertyFlags flags) {
    VkPhysicalDeviceMemoryProperties all;
    vkGetPhysicalDeviceMemoryProperties(host->physical, &all);
    uint32_t kind = 0;
    while (kind < all.memoryTypeCount &&
           ((needs.memoryTypeBits & (1u << kind)) == 0 ||
            (all.memoryTypes[kind].propertyFlags & flags) != flags)) {
        kind++;
    }
    VkMemoryAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                 .allocationSize = needs.size,
                                 .memoryTypeIndex = kind};
    VkDeviceMemory memory;
    vulkan(vkAllocateMemory(host->device, &info, NULL, &memory), "memory");
    return memory;
}

static Plane new_plane(const Host *host, VkFormat format, VkImageUsageFlags usage,
                       VkImageAspectFlags aspect) {
    Plane plane;
    VkImageCreateInfo info = {.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                              .imageType = VK_IMAGE_TYPE_2D,
                              .format = format,
                              .extent = {WIDTH, HEIGHT, 1},
                              .mipLevels = 1,
                              .arrayLayers = 1,
                              .samples = VK_SAMPLE_COUNT_1_BIT,
                              .usage = usage};
    vulkan(vkCreateImage(host->device, &info, NULL, &plane.image), "image");
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(host->device, plane.image, &needs);
    plane.memory = take_memory(host, needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    vulkan(vkBindImageMemory(host->device, plane.image, plane.memory, 0), "image");
    VkImageViewCreateInfo look = {
        .sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
        .image = plane.image,
        .viewType = VK_IMAGE_VIEW_TYPE_2D,
        .format = format,
        .subresourceRange = {.aspectMask = aspect, .levelCount = 1, .layerCount = 1}};
    vulkan(vkCreateImageView(host->device, &look, NULL, &plane.view), "view");
    return plane;
}

/* A pass that clears both images and leaves colour for copying. */
static VkRenderPass new_pass(const Host *host) {
    VkAttachmentDescription attachments[2] = {
        {.format = COLOUR,
         .samples = VK_SAMPLE_COUNT_1_BIT,
         .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
         .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
         .stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE,
         .stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
         .finalLayout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL},
        {.format = host->depth_format,
         .samples = VK_SAMPLE_COUNT_1_BIT,
         .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
         .storeOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
         .stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE,
         .stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
         .finalLayout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL}};
    VkAttachmentReference colour = {0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    VkAttachmentReference depth = {1, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL};
    VkSubpassDescription subpass = {.colorAttachmentCount = 1,
                                    .pColorAttachments = &colour,
                                    .pDepthStencilAttachment = &depth};
    VkPipelineStageFlags draw = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT |
                                VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT |
                                VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT;
    VkAccessFlags write =
        VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT;
    VkAccessFlags read =
        VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT;
    /* After the last frame's drawing and its copy; before the copy of this one. */
    VkSubpassDependency dependencies[2] = {
        {.srcSubpass = VK_SUBPASS_EXTERNAL,
         .srcStageMask = draw | VK_PIPELINE_STAGE_TRANSFER_BIT,
         .srcAccessMask = write,
         .dstStageMask = draw,
         .dstAccessMask = write | read},
        {.dstSubpass = VK_SUBPASS_EXTERNAL,
         .srcStageMask = draw,
         .srcAccessMask = write,
         .dstStageMask = VK_PIPELINE_STAGE_TRANSFER_BIT,
         .dstAccessMask = VK_ACCESS_TRANSFER_READ_BIT}};
    VkRenderPassCreateInfo info = {.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO,
                                   .attachmentCount = 2,
                                   .pAttachments = attachments,
                                   .subpassCount = 1,
                                   .pSubpasses = &subpass,
                                   .dependencyCount = 2,
                                   .pDependencies = dependencies};
    VkRenderPass pass;
    vulkan(vkCreateRenderPass(host->device, &info, NULL, &pass), "pass");
    return pass;
}

static void new_slots(Host *host) {
    VkCommandPoolCreateInfo of_pool = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                       .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT,
                                       .queueFamilyIndex = host->family};
    vulkan(vkCreateCommandPool(host->device, &of_pool, NULL, &host->pool), "pool");
    VkCommandBufferAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                        .commandPool = host->pool,
                                        .commandBufferCount = IN_FLIGHT};
    vulkan(vkAllocateCommandBuffers(host->device, &info, host->buffers), "command buffers");
    VkFenceCreateInfo signalled = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO,
                                   .flags = VK_FENCE_CREATE_SIGNALED_BIT};
    for (int i = 0; i < IN_FLIGHT; i++) {
        vulkan(vkCreateFence(host->device, &signalled, NULL, &host->fences[i]), "fence");
    }
}

/* Images as the terrain's depth wants them, the pass over them, and a buffer for the pixels. */
static void new_canvas(Host *host, const ovf_limits *limits) {
    int is_d32f = limits->depth_format == OVF_DEPTH_D32F;
    host->depth_format = is_d32f ? VK_FORMAT_D32_SFLOAT : VK_FORMAT_X8_D24_UNORM_PACK32;
    host->far_depth = limits->depth_order == OVF_DEPTH_REVERSED ? 0.0f : 1.0f;
    host->colour = new_plane(host, COLOUR,
                             VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                             VK_IMAGE_ASPECT_COLOR_BIT);
    host->depth = new_plane(host, host->depth_format, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT,
                            VK_IMAGE_ASPECT_DEPTH_BIT);
    host->pass = new_pass(host);
    VkImageView views[] = {host->colour.view, host->depth.view};
    VkFramebufferCreateInfo info = {.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO,
                                    .renderPass = host->pass,
                                    .attachmentCount = 2,
                                    .pAttachments = views,
                                    .width = WIDTH,
                                    .height = HEIGHT,
                                    .layers = 1};
    vulkan(vkCreateFramebuffer(host->device, &info, NULL, &host->framebuffer), "framebuffer");
    VkBufferCreateInfo of_pixels = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                                    .size = 4 * WIDTH * HEIGHT,
                                    .usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT};
    vulkan(vkCreateBuffer(host->device, &of_pixels, NULL, &host->pixels), "buffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(host->device, host->pixels, &needs);
    host->pixel_memory = take_memory(
        host, needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    vulkan(vkBindBufferMemory(host->device, host->pixels, host->pixel_memory, 0), "buffer");
    new_slots(host);
}

/* Writes the last picture, once the device has finished it, as a PPM. */
static void write_picture(Host *host, const char *path) {
    VkCommandBuffer buffer = begin(host);
    VkBufferImageCopy all = {
        .imageSubresource = {.aspectMask = VK_IMAGE_ASPECT_COLOR_BIT, .layerCount = 1},
        .imageExtent = {WIDTH, HEIGHT, 1}};
    vkCmdCopyImageToBuffer(buffer, host->colour.image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                           host->pixels, 1, &all);
    VkMemoryBarrier to_host = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
                               .srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT,
                               .dstAccessMask = VK_ACCESS_HOST_READ_BIT};
    vkCmdPipelineBarrier(buffer, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1,
                         &to_host, 0, NULL, 0, NULL);
    submit(host);
    vulkan(vkDeviceWaitIdle(host->device), "waiting");
    void *mapped;
    vulkan(vkMapMemory(host->device, host->pixel_memory, 0, VK_WHOLE_SIZE, 0, &mapped), "mapping");
    const unsigned char *pixels = mapped;
    FILE *file = fopen(path, "wb");
    int good = file != NULL && fprintf(file, "P6\n%d %d\n255\n", WIDTH, HEIGHT) > 0;
    for (int i = 0; good && i < WIDTH * HEIGHT; i++) {
        good = fwrite(pixels + 4 * i, 3, 1, file) == 1;
    }
    if (file == NULL || fclose(file) != 0 || !good) {
        fprintf(stderr, "%s cannot be written\n", path);
        exit(1);
    }
    vkUnmapMemory(host->device, host->pixel_memory);
}

static void close_host(Host *host) {
    VkDevice device = host->device;
    for (int i = 0; i < IN_FLIGHT; i++) {
        vkDestroyFence(device, host->fences[i], NULL);
    }
    vkDestroyCommandPool(device, host->pool, NULL);
    vkDestroyBuffer(device, host->pixels, NULL);
    vkFreeMemory(device, host->pixel_memory, NULL);
    vkDestroyFramebuffer(device, host->framebuffer, NULL);
    vkDestroyRenderPass(device, host->pass, NULL);
    Plane planes[] = {host->colour, host->depth};
    for (int i = 0; i < 2; i++) {
        vkDestroyImageView(device, planes[i].view, NULL);
        vkDestroyImage(device, planes[i].image, NULL);
        vkFreeMemory(device, planes[i].memory, NULL);
    }
    vkDestroyDevice(device, NULL);
    if (host->validates) {
        PFN_vkDestroyDebugUtilsMessengerEXT destroy =
            (PFN_vkDestroyDebugUtilsMessengerEXT)vkGetInstanceProcAddr(
                host->instance, "vkDestroyDebugUtilsMessengerEXT");
        destroy(host->instance, host->messenger, NULL);
    }
    vkDestroyInstance(host->instance, NULL);
}

int main(int count, char **words) {
    if (count != 2) {
        fprintf(stderr, "usage: own_vulkan FILE.ppm\n");
        return 2;
    }
    ovf_scene scene = {.struct_size = sizeof scene, .text = SCENE};
    ovf_host helpers = {.struct_size = sizeof helpers, .pages = OVF_PAGES_WAITED};
    ovf_terrain terrain;
    must(ovf_terrain_new_v1(&scene, &helpers, &terrain), "opening the scene");
    ovf_limits limits = {.struct_size = sizeof limits};
    must(ovf_terrain_limits(terrain, &limits), "limits");

    Host host;
    memset(&host, 0, sizeof host);
    open_instance(&host);
    open_device(&host);
    new_canvas(&host, &limits);

    ovf_renderer renderer = new_renderer(&host, terrain);
    fly_and_draw(&host, terrain, renderer);
    write_picture(&host, words[1]);

    /* The device is idle. A renderer may outlive its terrain, but not the device. */
    must(ovf_terrain_destroy(terrain), "destroying the terrain");
    must(ovf_renderer_destroy(renderer), "destroying the renderer");
    close_host(&host);
    printf("%s\n", words[1]);
    if (!host.validates) {
        printf("validation layer: not installed\n");
        return 0;
    }
    printf("validation messages: %u\n", host.messages);
    return host.messages > 0;
}
