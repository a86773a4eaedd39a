/* What functions that are compiled ahead of time need when they are called without numba, see hsv/ahead_of_time.py:
 * memory for the arrays that they make, and the arrays and lanes that they are given.
 *
 * Python's and numpy's headers need not be there: what is used of them has been the same in all their versions. */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Memory: names and fields are those of numba's run time (runtime/nrt.cpp). */

struct MemInfo {
    size_t references;
    void (*destructor)(void *data, size_t size, void *info);
    void *destructor_info;
    void *data;
    size_t size;
    void *external_allocator;
};

void *NRT_Allocate(size_t size) { return malloc(size); }

void NRT_Free(void *pointer) { free(pointer); }

struct MemInfo *NRT_MemInfo_alloc_aligned(size_t size, unsigned align)
{
    struct MemInfo *memory = malloc(sizeof *memory + size + align);
    if (memory == NULL)
        return NULL;
    uintptr_t data = (uintptr_t)(memory + 1);
    data += (align - data % align) % align;
    *memory = (struct MemInfo){1, NULL, NULL, (void *)data, size, NULL};
    return memory;
}

void NRT_MemInfo_call_dtor(struct MemInfo *memory) { free(memory); }

/* Gives back an array that a function has returned; memory of the caller has none of these. */
void hsv_release(struct MemInfo *memory)
{
    if (memory != NULL && __atomic_sub_fetch(&memory->references, 1, __ATOMIC_ACQ_REL) == 0)
        free(memory);
}

/* Arrays that are given. */

struct Object {
    intptr_t references;
    void *type;
};

struct Type {
    struct Object head;
    void *scalar;
    char kind, letter, byte_order, flags;
    int number;
};

struct Array { /* PyArrayObject_fields of numpy's C interface */
    struct Object head;
    char *data;
    int axes;
    intptr_t *shape, *strides;
    struct Object *base;
    struct Type *type;
    int flags;
};

extern void *PyExc_TypeError;
void PyErr_SetString(void *type, const char *text);

static void *array_type;
static intptr_t no_lengths[64]; /* as many axes as numpy admits */
static const struct Array no_array = {.shape = no_lengths, .strides = no_lengths};

/* Says what numpy.ndarray is, before anything else is called. */
void hsv_begin(void *type) { array_type = type; }

/* An array with so many axes and these flags of numpy's, of a type by its number; else an empty one, and an error of
 * Python's. */
const struct Array *hsv_array(struct Object *object, int64_t axes, int64_t number, int64_t flags)
{
    const struct Array *array = (const struct Array *)object;
    if (object->type == array_type && array->axes == axes && array->type->number == number &&
        array->type->byte_order != '>' && (array->flags & flags) == flags)
        return array;
    PyErr_SetString(PyExc_TypeError, "expected an array of the type and order that was compiled for");
    return &no_array;
}

/* Lanes that are given, see hsv/lane_arrays.py. */

void *PyErr_Occurred(void);
void *PyErr_Format(void *type, const char *format, ...);
void *PyObject_GetAttrString(void *object, const char *name);
const char *PyUnicode_AsUTF8(void *text);
void *PyTuple_GetItem(void *tuple, intptr_t index);
long long PyLong_AsLongLong(void *number);
void Py_DecRef(void *object);

/* Writes a whole number and gives back its object; returns whether it was one, else there is an exception. */
static int read_number(void *object, int64_t *number)
{
    if (object == NULL)
        return 0;
    *number = PyLong_AsLongLong(object);
    Py_DecRef(object);
    return PyErr_Occurred() == NULL;
}

static int read_shape(void *shape, int64_t axes, int64_t *lengths)
{
    int read = shape != NULL;
    for (int64_t i = 0; read && i < axes; i++) {
        void *length = PyTuple_GetItem(shape, i); /* which the tuple keeps */
        if (length != NULL)
            lengths[i] = PyLong_AsLongLong(length);
        read = PyErr_Occurred() == NULL;
    }
    Py_DecRef(shape);
    return read;
}

static int has_kind(void *object, const char *kind)
{
    void *name = PyObject_GetAttrString(object, "kind");
    const char *text = name == NULL ? NULL : PyUnicode_AsUTF8(name);
    int same = text != NULL && strcmp(text, kind) == 0;
    Py_DecRef(name);
    return same;
}

/* Writes address and, of an array, stride and lengths of lanes of a kind; otherwise writes zeros and sets an exception. */
void hsv_lanes(void *object, const char *kind, int64_t axes, int64_t *found)
{
    int fits = 0;
    if (PyErr_Occurred() == NULL) { /* an attribute lookup could clear it */
        fits = has_kind(object, kind) && read_number(PyObject_GetAttrString(object, "address"), &found[0]);
        if (fits && axes > 0)
            fits = read_number(PyObject_GetAttrString(object, "stride"), &found[1]) &&
                   read_shape(PyObject_GetAttrString(object, "shape"), axes, &found[2]);
        if (!fits)
            PyErr_Format(PyExc_TypeError, "expected a %s", kind);
    }
    for (int64_t i = fits ? axes + 2 : 0; i < axes + 2; i++)
        found[i] = 0;
}
