"""The search for what is missing: score tests, patches, terms chosen one by one."""
